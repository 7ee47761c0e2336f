#include "mbtfm/fit_effects.h"

#include <algorithm>
#include <optional>

#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/common_motion.h"
#include "pipeline/files/csv.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/choice/factory.h"
#include "substrate/response.h"

namespace mbtfm::tensions {
namespace {

/// The fit again, with other networks, data or loss. From the same start as a run that has the effect from the first.
EnsembleFit fit_again(const FittedCell& c, const std::vector<cables::CableNetwork>& networks, LinearData data,
                      std::optional<Loss> loss, int threads) {
  FitParameters parameters = c.parameters.fit;
  parameters.loss = loss;
  parameters.bootstrap = 0;
  return fit_ensemble(networks, data, adhesion_ids_of(c.cell), parameters, threads, {});
}

/// Without what a robust loss has made of the beads' weights.
LinearData unweighted(LinearData data) {
  reweight(data, Eigen::VectorXd::Ones(data.bead_weight.size()));
  return data;
}

std::optional<Change> change_by_gel(EffectKind kind, const FittedCell& c,
                                    const substrate::SubstrateParameters& parameters, int threads) {
  const auto gel = choice::make_substrate(c.parameters.gel, parameters, threads);
  LinearData with = c.data;
  with.response = gel->response({ellipses_of(c.inputs.cell)}, {points_of(c.inputs.beads)})->kept();
  return change_between(kind, c.fit,
                        fit_again(c, c.networks, unweighted(std::move(with)), c.parameters.fit.loss, threads));
}

std::optional<Change> with_base(const Effect& e, const FittedCell& c, int threads) {
  substrate::SubstrateParameters parameters = c.parameters.substrate;
  parameters.model = substrate::ModelKind::automatic;
  parameters.effects.finite_thickness = Switch::on;
  return change_by_gel(e.kind, c, parameters, threads);
}

std::optional<Change> with_sides(const Effect& e, const FittedCell& c, int threads) {
  substrate::SubstrateParameters parameters = c.parameters.substrate;
  if (!parameters.side_distance_um) return {};
  parameters.model = substrate::ModelKind::automatic;
  parameters.effects.finite_sides = Switch::on;
  Switch& base = parameters.effects.finite_thickness;
  if (base == Switch::off) base = Switch::automatic;
  return change_by_gel(e.kind, c, parameters, threads);
}

/// Where the effect's number bounds the change of the field, and so of the forces that displace the gel as far. A
/// graded gel's own solution is off by some per cent, more than a grading that is left out.
std::optional<Change> bounded_by_number(const Effect& e) {
  if (!e.number) return {};
  return Change{.effect = e.kind, .by_tension_nN = {}, .at_most = e.number};
}

std::optional<Change> with_elasticity(const Effect& e, const FittedCell& c, int threads) {
  const auto elastic = of_cables(c.networks, c.parameters.cables);
  return change_between(e.kind, c.fit, fit_again(c, elastic, c.data, c.parameters.fit.loss, threads));
}

std::optional<Change> with_loss(const Effect& e, const FittedCell& c, int threads) {
  return change_between(e.kind, c.fit, fit_again(c, c.networks, c.data, c.parameters.fit.robust_kind, threads));
}

std::optional<Change> with_motion(const Effect& e, const FittedCell& c, int threads) {
  LinearData with = c.data;
  add_motions(with, affine_motions(c.inputs.beads));
  return change_between(e.kind, c.fit,
                        fit_again(c, c.networks, unweighted(std::move(with)), c.parameters.fit.loss, threads));
}

/// None where the image shows the whole cell.
std::optional<Change> with_forces_beyond(const Effect& e, const FittedCell& c, int threads) {
  if (cuts_of(c.cell).empty()) return {};
  LinearData with = unweighted(c.data);
  allow_forces_beyond(with, c.cell, c.parameters.gel);
  return change_between(e.kind, c.fit, fit_again(c, c.networks, std::move(with), c.parameters.fit.loss, threads));
}

/// What it changes of the network's tension.
std::optional<Change> with_fibres(const Effect& e, const FittedCell& c, int threads) {
  if (c.cell.fibres.empty()) return {};
  const auto networks = of_cables(
      span_ensemble(mesh::generate_network(c.cell, c.parameters.network).network, c.cell, c.parameters, threads),
      c.networks.front().parameters());
  return change_between(e.kind, c.fit, fit_again(c, networks, c.data, c.parameters.fit.loss, threads));
}

std::optional<Change> change_with(const Effect& e, const FittedCell& c, int threads) {
  switch (e.kind) {
    case EffectKind::stress_fibres:
      return with_fibres(e, c, threads);
    case EffectKind::finite_thickness:
      return with_base(e, c, threads);
    case EffectKind::finite_sides:
      return with_sides(e, c, threads);
    case EffectKind::depth_graded_gel:
    case EffectKind::uneven_surface:
      return bounded_by_number(e);
    case EffectKind::cable_elasticity:
      return with_elasticity(e, c, threads);
    case EffectKind::robust_loss:
      return with_loss(e, c, threads);
    case EffectKind::common_motion:
      return with_motion(e, c, threads);
    case EffectKind::beyond_cut:
      return with_forces_beyond(e, c, threads);
    default:
      return {};
  }
}

/// Of those that change no tension, or of which nothing is known.
std::string in_words(EffectKind kind) {
  switch (kind) {
    case EffectKind::vertical_displacement:
      return "would change no tension: nothing along the surface depends on it";
    case EffectKind::time_coupling:
      return "would change no tension but by the fit's tolerance: only where the fit begins";
    case EffectKind::beyond_cut:
      return "would change no tension: the image shows the whole cell";
    default:
      return "would change nothing that can be told: there is no datum of it";
  }
}

}  // namespace

std::vector<cables::CableNetwork> span_ensemble(const Network& first, const Cell& cell, const FitStageParameters& p,
                                                int threads) {
  std::vector<Network> networks(static_cast<std::size_t>(p.fit.n_meshes));
  networks.front() = first;
  numerics::parallel_for(p.fit.n_meshes - 1, threads, [&](int m) {
    mesh::NetworkParameters parameters = p.network;
    parameters.seed += static_cast<std::uint64_t>(m) + 1;
    networks[static_cast<std::size_t>(m) + 1] = mesh::generate_network(cell, parameters).network;
  });
  std::vector<cables::CableNetwork> cables;
  for (Network& network : networks) cables.emplace_back(std::move(network), p.cables);
  return cables;
}

std::vector<cables::CableNetwork> of_cables(const std::vector<cables::CableNetwork>& networks,
                                            const cables::CableParameters& cables) {
  std::vector<cables::CableNetwork> result;
  for (const cables::CableNetwork& n : networks) result.emplace_back(n.network(), cables);
  return result;
}

std::vector<Change> explain(std::vector<Effect>& effects, const FittedCell& cell, int threads) {
  std::vector<Change> changes;
  for (Effect& effect : effects) {
    if (effect.is_on) continue;
    const std::optional<Change> change = change_with(effect, cell, threads);
    effect.would_change = change ? sentence(*change, cell.fit) : in_words(effect.kind);
    if (!change) continue;
    effect.change = relative(*change, cell.fit);
    changes.push_back(*change);
  }
  return changes;
}

void declare(stage::ParameterList& list, FitStageParameters& p) {
  declare(list, p.gel);
  declare(list, p.network);
  declare(list, p.cables);
  declare(list, p.substrate);
  declare(list, p.fit);
  declare(list, p.segmentation);
  list.add("explain", p.explain, "estimate how far each effect that is off would change the tensions");
  declare(list, p.effects,
          {"stress_fibres", "finite_thickness", "finite_sides", "depth_graded_gel", "vertical_displacement",
           "common_motion", "beads_under_load", "channel_shift", "beyond_cut", "cable_elasticity", "robust_loss",
           "time_coupling", "effect_tolerance"});
}

}  // namespace mbtfm::tensions
