#include "mbtfm/fit/effects.h"

#include <algorithm>

#include "mbtfm/fit/fit_cell.h"
#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/effects.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "substrate/choice/factory.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

/// The fit again, with other networks, data or loss. From the same start as a run that has the effect from the first.
EnsembleFit fit_again(const FittedCell& c, const std::vector<cables::CableNetwork>& networks, LinearData data,
                      std::optional<Loss> loss, int threads) {
  FitParameters parameters = c.parameters.fit;
  parameters.loss = loss;
  parameters.bootstrap = 0;
  return fit_ensemble(networks, data, adhesion_ids_of(c.seen), parameters, threads);
}

Change change_with_data(const FittedCell& c, const Effect& e, LinearData data, int threads) {
  return change_between(e.kind, c.fit, fit_again(c, c.ready.networks, std::move(data), c.parameters.fit.loss, threads));
}

Change change_with_networks(const FittedCell& c, const Effect& e, const std::vector<cables::CableNetwork>& networks,
                            int threads) {
  return change_between(e.kind, c.fit, fit_again(c, networks, c.fit.data, c.parameters.fit.loss, threads));
}

Change change_with_gel(const FittedCell& c, const Effect& e, const substrate::SubstrateParameters& parameters,
                       int threads) {
  const auto gel = choice::make_substrate(c.parameters.gel, parameters, threads);
  const GelUnderCell on{.gel = *gel, .cell = c.ready.scene.cell, .parameters = c.parameters, .threads = threads};
  return change_with_data(c, e, with_response(c.fit.data, response_of(on, c.ready.scene.beads)), threads);
}

std::optional<Change> with_base(const FittedCell& c, const Effect& e, int threads) {
  substrate::SubstrateParameters parameters = c.parameters.substrate;
  parameters.model = substrate::ModelKind::automatic;
  parameters.effects.finite_thickness = Switch::on;
  return change_with_gel(c, e, parameters, threads);
}

std::optional<Change> with_sides(const FittedCell& c, const Effect& e, int threads) {
  substrate::SubstrateParameters parameters = c.parameters.substrate;
  if (!parameters.side_distance_um) return {};
  parameters.model = substrate::ModelKind::automatic;
  parameters.effects.finite_sides = Switch::on;
  Switch& base = parameters.effects.finite_thickness;
  if (base == Switch::off) base = Switch::automatic;
  return change_with_gel(c, e, parameters, threads);
}

/// Where the effect's number bounds the change of the field, and so of the forces that displace the gel as far. A
/// graded gel's own solution is off by some per cent, more than a grading that is left out.
std::optional<Change> bounded_by_number(const FittedCell&, const Effect& e, int) {
  if (!e.number) return {};
  return Change{.effect = e.kind, .by_tension_nN = {}, .at_most = e.number};
}

std::optional<Change> with_elasticity(const FittedCell& c, const Effect& e, int threads) {
  return change_with_networks(c, e, of_cables(c.ready.networks, c.parameters.cables), threads);
}

std::optional<Change> with_loss(const FittedCell& c, const Effect& e, int threads) {
  return change_between(e.kind, c.fit,
                        fit_again(c, c.ready.networks, c.fit.data, c.parameters.fit.robust_kind, threads));
}

std::optional<Change> with_motion(const FittedCell& c, const Effect& e, int threads) {
  return change_with_data(c, e, unweighted(with_more_motions(c.fit.data, affine_motions(c.ready.scene.beads))),
                          threads);
}

/// None if the image shows the whole cell, and no other.
std::optional<Change> with_forces_beyond(const FittedCell& c, const Effect& e, int threads) {
  if (!has_forces_beyond(c.seen)) return {};
  auto [data, beyond] = with_forces_beyond(unweighted(c.fit.data), c.seen, c.parameters.gel);
  return change_with_data(c, e, std::move(data), threads);
}

/// What it changes of the network's tension.
std::optional<Change> with_fibres(const FittedCell& c, const Effect& e, int threads) {
  if (c.seen.fibres.empty()) return {};
  return change_with_networks(
      c, e, of_cables(span_ensemble(c.seen, c.parameters, threads), c.ready.networks.front().parameters()), threads);
}

template <EffectKind kind>
Effect of_gel(const FittedCell& c) {
  const std::vector<Effect> effects = c.ready.gel->effects();
  return *std::ranges::find(effects, kind, &Effect::kind);
}

template <Effect Decisions::*decision>
Effect on_the_way(const FittedCell& c) {
  return c.ready.decisions.*decision;
}

Effect of_common_motion(const FittedCell& c) {
  return common_motion_effect(c.parameters.effects.common_motion, c.motions.common);
}

Effect of_forces_beyond(const FittedCell& c) {
  return beyond_cut_effect(c.parameters.effects.beyond_cut, c.seen, c.ready.beyond);
}

Effect of_loss(const FittedCell& c) { return robust_loss_effect(c.parameters.effects.robust_loss, c.fit.misfit.loss); }

}  // namespace

const std::vector<EffectRow>& table_of_effects() {
  using enum EffectKind;
  using D = Decisions;
  static const std::vector<EffectRow> table = {
      {stress_fibres, "stress_fibres", on_the_way<&D::fibres>, with_fibres},
      {finite_thickness, "finite_thickness", of_gel<finite_thickness>, with_base},
      {finite_sides, "finite_sides", of_gel<finite_sides>, with_sides},
      {depth_graded_gel, "depth_graded_gel", of_gel<depth_graded_gel>, bounded_by_number},
      {vertical_displacement, "vertical_displacement", of_gel<vertical_displacement>, nullptr,
       "would change no tension: nothing along the surface depends on it"},
      {large_strain, "large_strain", on_the_way<&D::strain>, bounded_by_number},
      {uneven_surface, "", of_gel<uneven_surface>, bounded_by_number},
      {common_motion, "common_motion", of_common_motion, with_motion},
      {beads_under_load, "beads_under_load", on_the_way<&D::under_load>},
      {channel_shift, "channel_shift", on_the_way<&D::placement>},
      {beyond_cut, "beyond_cut", of_forces_beyond, with_forces_beyond,
       "would change no tension: the image shows the whole cell"},
      {cable_elasticity, "cable_elasticity", on_the_way<&D::elasticity>, with_elasticity},
      {robust_loss, "robust_loss", of_loss, with_loss},
      {time_coupling, "time_coupling", on_the_way<&D::time_coupling>, nullptr,
       "would change no tension but by the fit's tolerance: only where the fit begins"},
  };
  return table;
}

std::vector<std::string> effect_keys() {
  std::vector<std::string> keys = {"effect_tolerance"};
  for (const EffectRow& row : table_of_effects())
    if (!row.key.empty()) keys.emplace_back(row.key);
  return keys;
}

std::vector<Effect> effects_of(const FittedCell& cell) {
  std::vector<Effect> effects;
  for (const EffectRow& row : table_of_effects()) effects.push_back(row.decided(cell));
  return effects;
}

Explained explain(std::vector<Effect> effects, const FittedCell& cell, int threads) {
  Explained result{.effects = std::move(effects), .changes = {}};
  for (Effect& effect : result.effects) {
    if (effect.is_on) continue;
    const EffectRow& row = *std::ranges::find(table_of_effects(), effect.kind, &EffectRow::kind);
    const std::optional<Change> change = row.change ? row.change(cell, effect, threads) : std::nullopt;
    effect.would_change = change ? sentence(*change, cell.fit) : std::string(row.without_change);
    if (!change) continue;
    effect.change = relative(*change, cell.fit);
    result.changes.push_back(*change);
  }
  return result;
}

}  // namespace mbtfm::fit
