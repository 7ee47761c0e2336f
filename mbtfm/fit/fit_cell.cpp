#include "mbtfm/fit/fit_cell.h"

#include <mutex>

#include "mbtfm/fit/effects.h"
#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/fit/strained_gel.h"
#include "mbtfm/tensions/edge_forces.h"
#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/findings.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/missing.h"
#include "mbtfm/tensions/missing_adhesions.h"
#include "mbtfm/tensions/second_placement.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/stopwatch.h"
#include "substrate/choice/large_strain.h"
#include "substrate/models.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

/// The thesis' way to a trial's misfit: its displacements are solved for afresh (3.2.5). For comparison. One solution
/// at a time, as the substrate has threads of its own.
SolvedMisfit solved_misfit(const ReadyCell& cell, LinearData data) {
  data.reduced = {};  // not asked for, and large
  return [&gel = *cell.gel, data = std::move(data), points_um = points_of(cell.scene.beads),
          ellipses = substrate::ellipses_of(cell.scene.cell.adhesions),
          one_at_a_time = std::make_shared<std::mutex>()](const VectorXd& forces_nN) {
    const std::lock_guard lock(*one_at_a_time);
    const VectorXd u_um =
        substrate::column_of(gel.displacements_um(points_um, ellipses, substrate::vectors_of(forces_nN)));
    return data.weight_per_um.cwiseProduct(less_motion(data, data.displacement_um - u_um)).squaredNorm();
  };
}

EnsembleFit fit_networks(const ReadyCell& cell, LinearData data, const FitParameters& p, const Work& work) {
  const SolvedMisfit misfit =
      p.substrate == TrialDisplacement::per_evaluation ? solved_misfit(cell, data) : SolvedMisfit{};
  return fit_ensemble(cell.networks, std::move(data), adhesion_ids_of(cell.scene.cell), p, work, misfit, &cell.start);
}

struct ReadyAndFitted {
  ReadyCell ready;
  EnsembleFit fit;
};

Index n_of_place(const ReadyCell& cell) { return cell.decisions.placement.is_on ? 3 : 0; }

GelUnderCell under(const ReadyCell& cell, const Parameters& p, int threads) {
  return {.gel = *cell.gel, .cell = cell.scene.cell, .parameters = p, .threads = threads};
}

/// With `auto`, the linear fit where there is none: its effect says why.
EnsembleFit on_strained_gel(ReadyCell& ready, EnsembleFit fit, const Inputs& inputs, const Parameters& p,
                            const Work& work) {
  const Stopwatch watch;
  Effect& effect = ready.decisions.strain;
  const GelUnderCell on = under(ready, p, work.threads);
  effect = decide_strain(on, fit, !inputs.frames.empty());
  if (!effect.is_on) return fit;
  try {
    fit = fit_on_strained_gel(
        {on, ready.scene.beads, ready.decisions.under_load.is_on}, fit,
        [&](LinearData data, const Trial& start) {
          return fit_ensemble(ready.networks, std::move(data), adhesion_ids_of(on.cell), p.fit, work.threads, {},
                              &start);
        },
        work);
  } catch (const NotSolved& none) {
    if (effect.setting == Switch::on) throw;
    effect.is_on = false;
    effect.why += "; but " + none.report->reason;
  }
  effect.seconds = watch.seconds();
  return fit;
}

/// On elastic cables after all where the tensions that are found without call for them.
ReadyAndFitted on_cables(const Inputs& inputs, const Parameters& p, const Work& work) {
  auto [ready, data] = make_ready(inputs, p, work);
  const Work of_fit = work.part(0.4, inputs.frames.empty() ? 0.5 : 0.2);
  EnsembleFit fit = fit_networks(ready, std::move(data), p.fit, of_fit);
  const auto elasticity =
      elasticity_after_all(ready.decisions.elasticity, ready.networks.front(), fit.meshes.front().fit.trial, p);
  if (!elasticity) return {std::move(ready), std::move(fit)};
  ready = with_cables(std::move(ready), fit.data, p.cables, inputs);
  ready.decisions.elasticity = *elasticity;
  fit = fit_networks(ready, std::move(fit.data), p.fit, of_fit);
  return {std::move(ready), std::move(fit)};
}

/// The fit with all that the beads show besides the segmentation.
struct Searched {
  ReadyCell ready;
  WithMissing with;
  std::vector<MissingAdhesion> held = {};  ///< adhesions of the ready cell that the segmentation has not, the last ones
  /// As they were found.
  std::vector<MissingAdhesion> missing_adhesions() const {
    std::vector<MissingAdhesion> all = held;
    all.insert(all.end(), with.adhesions.begin(), with.adhesions.end());
    return all;
  }
};

Searched fit_and_search(const Inputs& inputs, const Parameters& p, const Work& work) {
  auto [ready, fit] = on_cables(inputs, p, work);
  fit = on_strained_gel(ready, std::move(fit), inputs, p, work.part(0.8, 0.1));
  WithMissing with = with_missing(std::move(fit), {.networks = ready.networks,
                                                   .cell = ready.scene.cell,
                                                   .gel = p.gel,
                                                   .segmentation = p.segmentation,
                                                   .parameters = p.fit,
                                                   .n_of_place = n_of_place(ready),
                                                   .threads = work.threads});
  return {std::move(ready), std::move(with)};
}

Readings readings_of(const ReadyCell& cell, const EnsembleFit& fit, const DisplacementField& beads, const Parameters& p,
                     int threads) {
  const FitSummary summary = summary_of(fit, cell.scene, 0, p.fit);
  if (unexplained_share(summary) <= kMuchUnexplained) return {};
  const MatrixXd& by_tension = fit.meshes.front().force_derivatives;
  return {.other = best_reading(under(cell, p, threads), beads, by_tension, summary.noise_um),
          .smoothed = best_smoothing(fit.data, by_tension, summary.noise_um)};
}

Figures figures_of(const Readings& found) {
  if (!found.other) return {};
  return {{"best_reading_leaves", found.other->unexplained_share},
          {"given_reading_leaves", found.other->unexplained_as_is},
          {"best_smoothing_leaves", found.smoothed->unexplained_share},
          {"unsmoothed_leaves", found.smoothed->unexplained_as_is}};
}

/// Forces at missing adhesions that are no minority: pictures or beads are wrong, and adhesions everywhere hide it.
bool are_many(const std::vector<MissingAdhesion>& missing, const EnsembleFit& fit, std::size_t n_seen) {
  constexpr double kMinority = 0.5;  // of the forces at those that were seen
  double sum_nN = 0;
  for (const MissingAdhesion& place : missing) sum_nN += norm(place.force_nN);
  return sum_nN > kMinority * total_nN(adhesion_forces_nN(fit).head(2 * static_cast<Index>(n_seen)));
}

/// A fibre whose adhesion was not found ends in the network, and no force at that place puts its tension right: the
/// networks are held there, too, as long as they then explain the beads better. If no such network can be made or
/// solved, the fit that there is stays.
Searched hold_where_beads_show(Searched searched, Inputs inputs, const Parameters& p, const Work& work) {
  constexpr int kMostRounds = 2;
  if (are_assumed(inputs.cell.adhesions)) return searched;
  const std::size_t n_seen = inputs.cell.adhesions.size();
  for (int round = 0; round < kMostRounds && !searched.with.adhesions.empty(); ++round) {
    if (are_many(searched.missing_adhesions(), searched.with.fit, n_seen)) break;
    inputs.cell = held_at(std::move(inputs.cell), searched.with.adhesions);
    Cell of_network = inputs.cell;
    if (!searched.ready.decisions.fibres.is_on) of_network.fibres.clear();
    try {
      inputs.network = mesh::generate_network(of_network, p.network).network;
      Searched next = fit_and_search(inputs, p, work);
      if (next.with.fit.misfit.chi_squared_per_degree >= searched.with.fit.misfit.chi_squared_per_degree) break;
      next.held = searched.missing_adhesions();
      searched = std::move(next);
    } catch (const NotSolved&) {
      break;
    } catch (const InvalidData&) {
      break;
    }
  }
  return searched;
}

/// Of the linear model and of what large strains add to it.
double substrate_error(const ReadyCell& cell) {
  const Effect& strain = cell.decisions.strain;
  return cell.gel->stated_error() + (strain.is_on ? choice::kStrainElementsError * strain.number.value_or(0) : 0);
}

ErrorBudget budget_of(const ReadyCell& cell, const EnsembleFit& fit, const Parameters& p, int threads) {
  return error_budget({.fit = fit,
                       .data = fit.data,
                       .networks = cell.networks,
                       .cell = cell.scene.cell,
                       .gel = p.gel,
                       .substrate_error = substrate_error(cell),
                       .lacks_base = !cell.gel->capabilities().base,
                       .segmentation = p.segmentation,
                       .n_of_place = n_of_place(cell)},
                      threads);
}

/// The fit of the cell with its candidates for adhesions at other places; beads, gel and cables as in the first.
EnsembleFit fit_of_second(Cell second, const ReadyCell& first, const Parameters& p, int threads) {
  if (!first.decisions.fibres.is_on) second.fibres.clear();
  second.neighbours_um = first.scene.cell.neighbours_um;
  const GelUnderCell on{.gel = *first.gel, .cell = second, .parameters = p, .threads = threads};
  const std::vector<cables::CableNetwork> networks =
      of_cables(span_ensemble(second, p, threads), first.networks.front().parameters());
  const auto fitted = [&](LinearData data, const Trial* start) {
    return fit_ensemble(networks, std::move(data), adhesion_ids_of(second), p.fit, threads, {}, start);
  };
  EnsembleFit fit = fitted(data_of(on, first.scene.beads), nullptr);
  if (!first.decisions.strain.is_on) return fit;
  return fit_on_strained_gel(
      {on, first.scene.beads, first.decisions.under_load.is_on}, std::move(fit),
      [&](LinearData data, const Trial& start) { return fitted(std::move(data), &start); }, threads);
}

Found found_by(const ReadyCell& cell, const EnsembleFit& fit, const std::optional<Cell>& second, const Parameters& p,
               const Work& work) {
  Found found{
      .tensions = tensions_of(fit),
      .forces = forces_of(fit, cell.scene.cell),
      .summary = summary_of(fit, cell.scene,
                            cables::surface_tension_nN_per_um(cell.networks.front().network(),
                                                              cell.scene.cell.outline_um, fit.tensions.nN[0].value),
                            p.fit)};
  const Stopwatch watch;
  found.summary.error_budget = budget_of(cell, fit, p, work.threads);
  if (second) {
    work.tell(0.9, "candidates at other places");
    const PlacementSpread spread = spread_between(fit, fit_of_second(*second, cell, p, work.threads));
    found.summary.error_budget = with_spread(std::move(*found.summary.error_budget), spread);
    found.summary.more.emplace_back("total_force_spread_by_placement_nN", spread.total_force_nN);
  }
  found.budget_s = watch.seconds();
  return found;
}

/// What the segmentation misses is found once, its forces in each frame.
std::vector<FrameFit> fit_frames(const ReadyCell& cell, const WithMissing& first,
                                 const std::vector<MissingAdhesion>& missing, const Inputs& inputs, const Parameters& p,
                                 const Work& work) {
  const SeriesOnGel& series = cell.series;
  if (series.frames.empty()) return {};
  const auto allow = [&](LinearData of_frame, const VectorXd& forces_nN) {
    if (cell.beyond) of_frame = with_forces_beyond(std::move(of_frame), cell.scene.cell, p.gel).data;
    if (!first.fitted.empty())
      of_frame = with_missing_fibres(std::move(of_frame), cell.scene.cell.adhesions, first.fitted, 0);
    if (!cell.decisions.placement.is_on) return of_frame;
    // the same place for all, but each frame has the error of it
    return with_place(std::move(of_frame), cell.scene.cell, p.gel, forces_nN, cell.placement.centre_um, work.threads);
  };
  const auto find = [&](EnsembleFit of_frame) {
    std::vector<MissingAdhesion> places = first.adhesions;
    if (!places.empty()) of_frame = with_their_forces(std::move(of_frame), places, p.gel, n_of_place(cell));
    of_frame = with_edge_forces(std::move(of_frame), first.fit.forces.edge, cell.scene.cell, p.gel, n_of_place(cell));
    return with_unfound(std::move(of_frame), cell.scene.cell, missing);
  };
  return fit_series(series.frames, cell.networks, series.response,
                    beads_in_region(beads_of(series.frames), cell.scene.cell, p.fit), adhesion_ids_of(cell.scene.cell),
                    p.fit, allows_common_motion(p.effects), cell.decisions.time_coupling.is_on, work,
                    next_start(first.fit), inputs.known_frames, allow, find);
}

ModelFields fields_of(const ReadyCell& cell, const EnsembleFit& fit, const ModelChecks& checks,
                      const DisplacementField& tracked) {
  const auto field = [&](const VectorXd& forces_nN) {
    return in_bead_frame(field_of(forces_nN, cell.scene.beads, fit.data), tracked, cell.placement);
  };
  return {.fitted = field(adhesion_forces_nN(fit)), .without_fibres = field(checks.models.front().forces_nN)};
}

FittedCell with_effects(FittedCell cell, const Work& work) {
  cell.effects = effects_of(cell);
  if (!cell.parameters.explain) return cell;
  work.tell(0.95, "explaining what is off");
  Explained explained = explain(std::move(cell.effects), cell, work.threads);
  cell.effects = std::move(explained.effects);
  cell.changes = std::move(explained.changes);
  return cell;
}

void append(Figures& figures, const Figures& more) { figures.insert(figures.end(), more.begin(), more.end()); }

}  // namespace

FittedCell fit_cell(const Inputs& inputs, const Parameters& given, const Work& work) {
  const Parameters p = as_switched(given);
  if (!inputs.frames.empty() && p.fit.substrate == TrialDisplacement::per_evaluation)
    throw UsageError("substrate = per-evaluation takes no time series: it would solve for each trial of each frame");
  check_place(inputs.beads, inputs.cell);
  Searched searched = fit_and_search(inputs, p, work);
  const Readings readings = readings_of(searched.ready, searched.with.fit, inputs.beads, p, work.threads);
  if (!is_read_wrongly(readings)) searched = hold_where_beads_show(std::move(searched), inputs, p, work);
  const std::vector<MissingAdhesion> missing = searched.missing_adhesions();
  auto& [ready, with, held] = searched;
  if (!is_read_wrongly(readings)) {
    const EdgeForces edge = edge_forces(with.fit, ready.scene.cell, p.gel);
    with.fit = with_edge_forces(std::move(with.fit), edge, ready.scene.cell, p.gel, n_of_place(ready));
  }
  with.fit = with_unfound(std::move(with.fit), ready.scene.cell, missing);
  const EnsembleFit& fit = with.fit;
  Found found = found_by(ready, fit, inputs.second_placement, p, work);
  FoundMotions motions = motions_found(ready, fit, p.effects);
  ModelChecks checks = check_model(ready, fit, p, work.threads);
  checks.missing_fibres = with.fibres;
  checks.missing_adhesions = with_forces_of(ready.scene.cell, adhesion_forces_nN(fit), held, with.adhesions);
  append(found.summary.more,
         energy_and_moments(fit, ready.scene.cell, p.gel, p.substrate.modulus_profile.empty(), work.threads));
  append(found.summary.more, figures_of(motions));
  append(found.summary.more, figures_of(checks, fit));
  ModelFields fields = fields_of(ready, fit, checks, inputs.beads);
  append(found.summary.more, figures_of(readings));
  std::vector<FrameFit> frames = fit_frames(ready, with, missing, inputs, p, work.part(0.6, 0.35));
  FittedCell cell{.seen = inputs.cell,
                  .parameters = p,
                  .ready = std::move(ready),
                  .fit = std::move(with.fit),
                  .found = std::move(found),
                  .motions = std::move(motions),
                  .checks = std::move(checks),
                  .fields = std::move(fields),
                  .reading = readings.other,
                  .smoothing = readings.smoothed,
                  .frames = std::move(frames)};
  return with_effects(std::move(cell), work);
}

}  // namespace mbtfm::fit
