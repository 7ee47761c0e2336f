/// mbtfm-fit: tensions, adhesion forces and their error bars from bead displacements.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>

#include "mbtfm/fit_effects.h"
#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/cross_validation.h"
#include "mbtfm/tensions/effects.h"
#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/findings.h"
#include "mbtfm/tensions/model_checks.h"
#include "mbtfm/tensions/placement.h"
#include "mbtfm/tensions/second_placement.h"
#include "mbtfm/tensions/series.h"
#include "mbtfm/tensions/solved_misfit.h"
#include "mbtfm/tensions/under_load.h"
#include "network/cables/effects.h"
#include "network/mesh/mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/named_array.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/stage.h"
#include "substrate/choice/factory.h"
#include "substrate/compliance.h"
#include "substrate/gel_vtu.h"
#include "substrate/response.h"

namespace mbtfm::tensions {
namespace {

FitInputs read_inputs(stage::StageContext& context) {
  FitInputs inputs{.cell = files::read_cell(context.input("cell", files::kCellFiles)),
                   .network = files::read_network(context.input("network")),
                   .beads = {}};
  const Path field = context.input("displacement");
  for (Bead& bead : files::read_displacement(field)) {
    if (bead.flag.empty())
      inputs.beads.push_back(std::move(bead));
    else
      ++inputs.n_flagged;
  }
  return inputs;
}

std::vector<bool> beads_in_region(const DisplacementField& beads, const Cell& cell, const FitParameters& p) {
  std::vector<bool> is_used;
  for (const Bead& b : beads) {
    is_used.push_back(!p.region_um || contains(cell.outline_um, b.position_um) ||
                      distance_to_boundary_um(cell.outline_um, b.position_um) <= *p.region_um);
  }
  return is_used;
}

void write_surface(const Path& file, const substrate::Substrate& substrate, const Cell& cell,
                   const std::vector<AdhesionForce>& forces, int n_lines) {
  std::vector<Vec2> forces_nN;
  for (const AdhesionForce& f : forces) forces_nN.push_back(f.force_nN);
  substrate::write_substrate_vtu(file, substrate, ellipses_of(cell), forces_nN, n_lines);
}

/// The network must be that of the cell as it is taken, with fibres or without.
void check_fibres(const FitInputs& inputs, const Effect& fibres, const Path& file) {
  const auto has_fibre = [](const Link& link) { return link.fibre_id != 0; };
  if (fibres.is_on || std::ranges::none_of(inputs.network.links, has_fibre)) return;
  throw InputError(file.string(), "a network without stress fibres, as effects.stress_fibres says", "fibres",
                   "span it anew: mbtfm-network with the same cell.toml");
}

/// … and be held where the image cuts it.
void check_cut(const FitInputs& inputs, const Path& file) {
  if (cuts_of(inputs.cell).empty() == inputs.network.held_by_cut.empty()) return;
  throw InputError(file.string(), "a network that the cut of outline.csv holds", "of an outline with another cut",
                   "span it anew: mbtfm-network with the same cell");
}

cables::CableParameters inelastic(cables::CableParameters cables) {
  cables.axial_stiffness_nN = 0;
  return cables;
}

/// The tensions found may stretch cables that those of the start did not. @returns whether elasticity was switched on
bool was_left_out_wrongly(Effect& elasticity, const cables::CableNetwork& network, const Trial& answer,
                          const FitStageParameters& p) {
  if (elasticity.is_on || elasticity.setting != Switch::automatic) return false;
  const double share = cables::stretch_share(network.network(), answer.equilibrium, p.cables.axial_stiffness_nN);
  if (share <= p.effects.effect_tolerance) return false;
  elasticity.is_on = true;
  elasticity.number = share;
  elasticity.why += "; but at the tensions found without it " + brief(share) + ", above: fitted again";
  return true;
}

/// "3 + 7: 5.2 ± 0.1 nN; …"
std::string names_of_groups(const EnsembleFit& fit) {
  std::string text;
  for (const FibreGroup& group : fibres_not_told_apart(fit)) {
    if (!text.empty()) text += "; ";
    for (std::size_t k = 0; k < group.indices.size(); ++k) {
      text += (k > 0 ? " + " : "") + std::to_string(fit.fibre_ids[static_cast<std::size_t>(group.indices[k])]);
    }
    text += ": " + brief(group.sum_nN.value) + " ± " + brief(group.sum_nN.standard_error) + " nN";
  }
  return text;
}

ErrorBudget budget_of(const EnsembleFit& fit, const LinearData& data, const std::vector<cables::CableNetwork>& networks,
                      const FitInputs& inputs, const substrate::Substrate& substrate, const FitStageParameters& p,
                      bool is_placed, int threads) {
  return error_budget({.fit = fit,
                       .data = data,
                       .networks = networks,
                       .cell = inputs.cell,
                       .beads = inputs.beads,
                       .gel = p.gel,
                       .substrate_error = substrate.stated_error(),
                       .lacks_base = !substrate.capabilities().base,
                       .segmentation = p.segmentation,
                       .n_of_place = is_placed ? 3 : 0},
                      threads);
}

/// The fit of the cell with its candidates for adhesions at other places; beads, gel and cables as in the first.
EnsembleFit fit_of(const Cell& second, const DisplacementField& beads, const substrate::Substrate& substrate,
                   const cables::CableParameters& cables, const FitStageParameters& p, int threads) {
  const Eigen::MatrixXd motions = allows_common_motion(p.effects) ? affine_motions(beads) : Eigen::MatrixXd();
  LinearData data = reduce(beads, substrate.response({ellipses_of(second)}, {points_of(beads)})->kept(),
                           beads_in_region(beads, second, p.fit), threads, motions);
  if (allows_forces_beyond(p.effects, second)) allow_forces_beyond(data, second, p.gel);
  const Network network = mesh::generate_network(second, p.network).network;
  return fit_ensemble(of_cables(span_ensemble(network, second, p, threads), cables), data, adhesion_ids_of(second),
                      p.fit, threads, {});
}

/// The checks of the model in a few figures.
Figures figures_of(const EnsembleFit& fit, const std::vector<ModelScore>& models,
                   const std::vector<FibreLeftOut>& left_out, const std::vector<MissingFibre>& missing) {
  const auto best = std::min_element(models.begin(), models.end(),
                                     [](const ModelScore& a, const ModelScore& b) { return a.bic < b.bic; });
  std::string unsupported;
  for (const FibreLeftOut& f : left_out) {
    if (f.aic_rise <= 0) unsupported += (unsupported.empty() ? "" : ", ") + std::to_string(f.fibre_id);
  }
  return {{"best_model_by_bic", best->name},
          {"fibres_not_told_apart", names_of_groups(fit)},
          {"fibres_without_support", unsupported},
          {"n_missing_fibres_hinted", std::int64_t(missing.size())}};
}

files::PointArray most_informed_array(const Influence& influence) {
  return {.name = "informs_fibre_id",
          .scalars = {influence.most_informed.begin(), influence.most_informed.end()},
          .vectors = {}};
}

/// What the loss and the region leave of each bead.
files::PointArray weight_array(const LinearData& data) {
  files::PointArray array{.name = "weight", .scalars = {}, .vectors = {}};
  for (Eigen::Index b = 0; b < data.bead_weight.size(); ++b) {
    array.scalars.push_back(data.weight_per_um[2 * b] > 0 ? data.bead_weight[b] : 0);
  }
  return array;
}

/// The tensions of the frame before, by the network's groups; fibres that are new since then at the others' mean.
Eigen::VectorXd start_of(stage::StageContext& context, const std::vector<int>& fibre_ids) {
  std::map<int, double> known;
  double sum = 0;
  for (const Tension& t : files::read_tensions(context.input("start"))) {
    known[t.fibre_id] = t.tension_nN;
    sum += t.tension_nN;
  }
  Eigen::VectorXd start(static_cast<Eigen::Index>(fibre_ids.size()));
  for (std::size_t i = 0; i < fibre_ids.size(); ++i) {
    const auto found = known.find(fibre_ids[i]);
    start[static_cast<Eigen::Index>(i)] =
        found != known.end() ? found->second : sum / static_cast<double>(std::max<std::size_t>(1, known.size()));
  }
  return start;
}

/// Draws take the tensions of this cell's own fibres of a type. None where it lacks dorsal or ventral ones.
std::optional<CrossValidation> cross_validation_of(const EnsembleFit& fit, const LinearData& data,
                                                   const cables::CableNetwork& network, const Cell& cell,
                                                   const FitParameters& p, int threads) {
  TypeTensions tensions;
  std::vector<FibreType> types;
  for (std::size_t i = 1; i < fit.fibre_ids.size(); ++i) {
    const auto fibre = std::find_if(cell.fibres.begin(), cell.fibres.end(),
                                    [&](const Fibre& f) { return f.fibre_id == fit.fibre_ids[i]; });
    types.push_back(fibre->type == FibreType::edge ? FibreType::ventral : fibre->type);  // held alike, at both ends
    tensions[types.back()].push_back(fit.tensions_nN[i].value);
  }
  if (p.cross_validation == 0 || !tensions.contains(FibreType::dorsal) || !tensions.contains(FibreType::ventral)) {
    return std::nullopt;
  }
  const TensionProblem problem(network, data.reduced, adhesion_ids_of(cell));
  return cross_validate(problem, data, fit.meshes.front().fit.trial, types, tensions, p.cross_validation, 1, threads);
}

/// Takes beads and data to the state that explains them better. Of a series every frame has a state of its own.
Effect take_state_of(FitInputs& inputs, LinearData& data,
                     const std::function<LinearData(const DisplacementField&)>& data_of, bool is_series,
                     const stage::EffectSwitches& effects, const Gel& gel, int threads) {
  if (is_series && effects.beads_under_load == Switch::on)
    throw UsageError("beads_under_load = on takes no time series: all frames share the beads' places at rest");
  if (is_series)
    return stage::decided(EffectKind::beads_under_load, effects.beads_under_load, false,
                          "all frames of a series share the beads' places at rest");
  double area_um2 = 0;
  for (const Adhesion& a : inputs.cell.adhesions) area_um2 += a.area_um2;
  const double size_um =
      std::sqrt(area_um2 / static_cast<double>(std::max<std::size_t>(1, inputs.cell.adhesions.size())));
  const auto carried = [&](const LinearData& at_rest) {
    return carried_um(gel, ellipses_of(inputs.cell), free_forces_nN(at_rest.reduced), at_rest.position_um,
                      at_rest.displacement_um, threads);
  };
  BeadsOfState state = take_state(inputs.beads, std::move(data), data_of, size_um, effects.effect_tolerance,
                                  effects.beads_under_load, carried);
  inputs.beads = std::move(state.beads);
  data = std::move(state.data);
  return state.effect;
}

/// Registers the files that it reads.
std::optional<Cell> second_placement_of(stage::StageContext& context, const Cell& cell) {
  std::optional<Cell> second = second_placement(context.inputs_.at("cell"), cell);
  if (second) context.input("cell", kSecondPlacementFiles);
  return second;
}

/// Registers the files that it reads.
std::vector<SeriesFrame> read_series_of(stage::StageContext& context) {
  if (!context.has_input("frames")) return {};
  std::vector<SeriesFrame> frames = read_series(context.input("frames", {"frames.csv"}));
  std::vector<std::string> names;
  for (const SeriesFrame& frame : frames) {
    if (frame.refused.empty()) names.push_back(files::displacement_of_frame(frame.frame));
  }
  context.input("frames", names);
  return frames;
}

/// Fit every frame of a time series, from the fit of the displacement on. @return in a few words, what came of it
std::string fit_frames(const std::vector<SeriesFrame>& frames, const substrate::SharedResponse& response,
                       const Cell& cell, const std::vector<cables::CableNetwork>& networks, const EnsembleFit& first,
                       const FitParameters& p, bool moves, const AllowMore& allow, bool is_coupled,
                       stage::StageContext& context) {
  const std::vector<FrameFit> fits = fit_series(
      frames, networks, response, beads_in_region(beads_of(frames), cell, p), adhesion_ids_of(cell), p, moves,
      is_coupled, context.threads, [&](double f, std::string_view what) { context.progress(0.6 + 0.35 * f, what); },
      next_start(first), context.has_input("kept") ? read_fits(context.inputs_.at("kept")) : std::vector<FrameFit>{},
      allow);
  write_tracks(context.output("out", "tracks.csv"), fits, cell.fibres, p.frame_interval_s);
  write_frames(context.output("out", "frames.csv"), fits, p.frame_interval_s);
  files::write_text(context.output("out", "tracks.svg"), series_picture(fits, cell.fibres, p.frame_interval_s));
  const auto n_refused = std::count_if(fits.begin(), fits.end(), [](const FrameFit& f) { return !f.refused.empty(); });
  return "; " + std::to_string(fits.size()) + " frames" +
         (n_refused > 0 ? ", " + std::to_string(n_refused) + " of them without a fit (see frames.csv)" : "");
}

/// @throws InputError where no cell pulls like that
void expect_plausible(stage::StageContext& context, const FitSummary& summary, const std::vector<Tension>& tensions,
                      const std::vector<AdhesionForce>& forces, const std::vector<Adhesion>& adhesions) {
  context.expect_plausible("total_force_nN",
                           std::max(0.0, summary.total_force_nN));  // of noise alone: either side of 0
  context.expect_plausible("fibre_tension_nN", stage::surest_fibre_tension_nN(tensions));
  context.expect_plausible("traction_kPa", stage::traction_of_half_the_force_kPa(forces, adhesions));
}

StageReport fit(const FitStageParameters& given, stage::StageContext& context) {
  FitStageParameters p = given;
  p.substrate.effects = p.effects;
  context.progress(0, "reading");
  FitInputs inputs = read_inputs(context);
  context.expect_plausible("beads_per_um2", beads_per_um2(inputs.beads));
  const Cell cell = inputs.cell;
  check_place(inputs.beads, cell);
  std::vector<SeriesFrame> series = read_series_of(context);
  if (!series.empty() && p.fit.substrate == TrialDisplacement::per_evaluation)
    throw UsageError("substrate = per-evaluation takes no time series: it would solve for each trial of each frame");
  Effect fibres = cables::take_fibres(inputs.cell, p.effects.stress_fibres);
  check_fibres(inputs, fibres, context.inputs_.at("network"));
  check_cut(inputs, context.inputs_.at("network"));
  const auto substrate = choice::make_substrate(p.gel, p.substrate, context.threads);
  context.progress(0.05, "compliance of the substrate");
  const auto response_on = [&](const DisplacementField& b) {
    return substrate->response({ellipses_of(inputs.cell)}, {points_of(b)})->kept();
  };
  Responses responses = responses_of(inputs.beads, series, response_on);
  const bool moves = allows_common_motion(p.effects);
  const auto reduced = [&](const DisplacementField& beads, substrate::SharedResponse response) {
    return reduce(beads, std::move(response), beads_in_region(beads, inputs.cell, p.fit), context.threads,
                  moves ? affine_motions(beads) : Eigen::MatrixXd());
  };
  LinearData data = reduced(inputs.beads, std::move(responses.of_beads));
  std::optional<ForcesBeyond> beyond;
  if (allows_forces_beyond(p.effects, cell)) beyond = allow_forces_beyond(data, cell, p.gel);
  const auto data_of = [&](const DisplacementField& beads) {
    LinearData there = reduced(beads, response_on(beads));
    if (beyond) allow_forces_beyond(there, inputs.cell, p.gel);
    return there;
  };
  const DisplacementField as_tracked = inputs.beads;
  const Effect under_load = take_state_of(inputs, data, data_of, !series.empty(), p.effects, p.gel, context.threads);
  p.fit.loss = loss_of_switch(p.effects.robust_loss, p.fit.robust_kind);
  context.progress(0.3, "spanning networks");
  std::vector<cables::CableNetwork> networks = span_ensemble(inputs.network, inputs.cell, p, context.threads);
  const Effect coupling =
      decide_time_coupling(context.has_input("start") || series.size() > 1, p.effects.time_coupling);
  const std::vector<int> adhesion_ids = adhesion_ids_of(inputs.cell);
  const auto start_on = [&](const cables::CableNetwork& network) {
    const TensionProblem problem(network, data.reduced, adhesion_ids);
    return coupling.is_on && context.has_input("start")
               ? scaled_to_data(problem, start_of(context, network.fibre_ids()))
               : uniform_start(problem);
  };
  Trial start = start_on(networks.front());
  const auto take_cables = [&](const cables::CableParameters& cables) {
    networks = of_cables(networks, cables);
    start = start_on(networks.front());
  };
  const Eigen::VectorXd& start_nN = start.tensions_nN;
  Effect elasticity =
      cables::decide_elasticity(networks.front(), {start_nN.data(), start_nN.data() + start_nN.size()}, p.effects);
  if (!elasticity.is_on) take_cables(inelastic(p.cables));
  context.progress(0.35, "placing the cell on the beads");
  const DisplacementField in_state = inputs.beads;
  const bool can_be_shifted = p.effects.channel_shift != Switch::automatic || !has_candidates(cell);
  PlacedCell place = place_cell(inputs.cell, networks.front(), in_state, data, data_of, p.gel, p.fit, start,
                                can_be_shifted ? p.effects.channel_shift : Switch::off, context.threads);
  if (!can_be_shifted)
    place.effect = stage::decided(
        EffectKind::channel_shift, p.effects.channel_shift, false,
        "candidates for adhesions have no place of their own: their lattice would be found, not the cell");
  data = std::move(place.data);
  if (place.effect.is_on) {
    inputs.beads = in_cell_frame(in_state, place.placement);
    for (SeriesFrame& frame : series) frame.beads = in_cell_frame(frame.beads, place.placement);
    if (!series.empty()) responses = responses_of(inputs.beads, series, response_on);
    start = std::move(place.start);
  }
  const auto fit_all = [&] {
    return fit_ensemble(
        networks, data, adhesion_ids, p.fit, context.threads,
        [&](double f, std::string_view what) { context.progress(0.4 + (series.empty() ? 0.5 : 0.2) * f, what); },
        p.fit.substrate == TrialDisplacement::per_evaluation
            ? solved_misfit(*substrate, points_of(inputs.beads), ellipses_of(inputs.cell), data)
            : SolvedMisfit{},
        &start);
  };
  EnsembleFit fit = fit_all();
  if (was_left_out_wrongly(elasticity, networks.front(), fit.meshes.front().fit.trial, p)) {
    take_cables(p.cables);
    fit = fit_all();
  }

  const std::vector<Tension> tensions = tensions_of(fit);
  const std::vector<AdhesionForce> forces = forces_of(fit, inputs.cell);
  const auto fitted_field = [&](const Eigen::VectorXd& forces_nN) {
    return in_bead_frame(field_of(forces_nN, inputs, data), as_tracked, place.placement);
  };
  const DisplacementField fitted = fitted_field(fit.forces_nN);
  FitSummary summary = summary_of(fit, data, inputs, networks, p.fit);
  const MotionsBeside motions = motions_beside(data, fit);
  std::optional<FoundMotion> motion;
  if (moves) motion = common_motion_among(motions, data.position_um);
  std::optional<FoundPlacement> found_place;
  if (place.effect.is_on) found_place = placement_among(motions, place.placement);
  std::optional<CurvedMotion> curved;
  if (moves) curved = curved_motion_beside(data, inputs.beads, fit);
  expect_plausible(context, summary, tensions, forces, inputs.cell.adhesions);
  const auto budget_start = std::chrono::steady_clock::now();
  summary.error_budget = budget_of(fit, data, networks, inputs, *substrate, p, place.effect.is_on, context.threads);
  if (std::optional<Cell> second = second_placement_of(context, cell)) {
    context.progress(0.9, "candidates at other places");
    if (!fibres.is_on) second->fibres.clear();
    const PlacementSpread spread = spread_between(
        fit, fit_of(*second, inputs.beads, *substrate, networks.front().parameters(), p, context.threads));
    summary.error_budget = with_spread(std::move(*summary.error_budget), spread);
    summary.more.emplace_back("total_force_spread_by_placement_nN", spread.total_force_nN);
  }
  const double budget_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - budget_start).count();
  if (motion) {
    for (const auto& figure : figures_of(*motion)) summary.more.push_back(figure);
  }
  if (found_place) {
    for (const auto& figure : figures_of(*found_place)) summary.more.push_back(figure);
  }
  const std::vector<ModelScore> models = compare_models(fit, data, networks.front(), adhesion_ids_of(inputs.cell));
  const Influence influence = influence_of(fit, data);
  const std::vector<FibreLeftOut> left_out = leave_each_fibre_out(fit, influence);
  const std::vector<MissingFibre> missing = missing_fibres(fit, inputs.cell.adhesions, context.threads);
  const std::vector<MissingAdhesion> missing_places = missing_adhesions(fit, data, inputs.cell, p.gel, context.threads);
  for (const auto& figure : figures_of(fit, models, left_out, missing)) summary.more.push_back(figure);
  write_correlations(context.output("out", "correlations.csv"), fit);
  write_models(context.output("out", "models.csv"), models);
  write_fibres_left_out(context.output("out", "fibres_left_out.csv"), left_out);
  write_missing_fibres(context.output("out", "missing_fibres.csv"), missing);
  write_missing_adhesions(context.output("out", "missing_adhesions.csv"), missing_places);
  const auto drawn = cross_validation_of(fit, data, networks.front(), inputs.cell, p.fit, context.threads);
  if (drawn) write_cross_validation(context.output("out", "cross_validation.csv"), *drawn);
  files::write_tensions(context.output("out", "tensions.csv"), tensions, inputs.cell.fibres);
  files::write_adhesion_forces(context.output("out", "adhesion_forces.csv"), forces, inputs.cell.adhesions);
  files::write_fit_summary(context.output("out", "fit.json"), summary, inputs.cell.fibres);
  write_contracted(context.output("out", "contracted.vtu"), networks.front(), fit);
  write_tractions_vtp(context.output("out", "tractions.vtp"), inputs.cell, forces);
  files::write_displacement(context.output("out", "fitted_displacement.csv"), fitted);
  files::write_displacement(context.output("out", "displacement_without_fibres.csv"),
                            fitted_field(models.front().forces_nN));
  write_displacement_vtp(context.output("out", "displacement.vtp"), as_tracked, fitted,
                         {most_informed_array(influence), weight_array(data)});
  const auto allow = [&](LinearData& of_frame, const Eigen::VectorXd& forces_nN) {
    if (beyond) allow_forces_beyond(of_frame, cell, p.gel);
    // the same place for all, but each frame has the error of it
    if (place.effect.is_on)
      allow_place(of_frame, inputs.cell, p.gel, forces_nN, place.placement.centre_um, context.threads);
  };
  const std::string of_series = series.empty() ? ""
                                               : fit_frames(series, responses.of_series, inputs.cell, networks, fit,
                                                            p.fit, moves, allow, coupling.is_on, context);
  context.progress(0.95, "surface of the gel");
  write_surface(context.output("out", "substrate.vtu"), *substrate, inputs.cell, forces, p.fit.surface_lines);
  context.progress(1, "done");

  const auto n_unidentifiable =
      std::count_if(tensions.begin(), tensions.end(), [](const Tension& t) { return !t.identifiable; });
  StageReport report{.converged = fit.report.converged,
                     .summary = std::to_string(tensions.size() - 1) + " fibre tensions, total force " +
                                brief(summary.total_force_nN) + " nN, relative L2 " + brief(summary.relative_l2),
                     .figures = summary.more,
                     .effects = {},
                     .findings = {}};
  report.effects = substrate->effects();
  report.effects.insert(report.effects.begin(), fibres);
  report.effects.insert(report.effects.end(),
                        {common_motion_effect(p.effects.common_motion, motion), under_load, place.effect,
                         beyond_cut_effect(p.effects.beyond_cut, cell, beyond), elasticity,
                         robust_loss_effect(p.effects.robust_loss, fit.loss), coupling});
  if (p.explain) {
    context.progress(0.97, "explaining what is off");
    const std::vector<Change> changes =
        explain(report.effects, {p, cell, inputs, networks, data, fit}, context.threads);
    write_changes(context.output("out", "effects_left_out.csv"), changes, fit);
  }
  report.summary += of_series;
  report.figures.emplace_back("error_budget_s", budget_s);
  context.notice(noticed(FindingKind::modulus_error_unknown, p.gel.youngs_modulus_sigma_kPa ? 0 : 1,
                         "No error of Young's modulus is given. An error of 10 % would change every force by 10 %."));
  report.findings = findings_of(
      FitOutcome{fit, data, cell, summary, tensions, missing, missing_places, motion, curved, found_place, beyond});
  const std::string together = names_of_groups(fit);
  if (!together.empty()) report.summary += "; not told apart, but their sum: fibres " + together;
  if (n_unidentifiable > 0)
    report.summary += "; " + std::to_string(n_unidentifiable) + (n_unidentifiable == 1 ? " tension" : " tensions") +
                      " not identifiable";
  if (inputs.n_flagged > 0) report.summary += "; " + std::to_string(inputs.n_flagged) + " flagged beads left out";
  if (!fit.report.converged) report.summary = fit.report.reason;
  for (const auto& figure : substrate->figures()) report.figures.push_back(figure);
  return report;
}

}  // namespace
}  // namespace mbtfm::tensions

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using namespace mbtfm::tensions;
  return mbtfm::stage::run_stage<FitStageParameters>(
      {.name = "fit",
       .purpose = "find the tension of every stress fibre and the force of every adhesion from bead displacements",
       .files = {{"cell", FileArgument::Kind::input,
                  "folder with adhesions.csv, fibres.csv, fibre_points.csv, outline.csv"},
                 {"network", FileArgument::Kind::input, "network.vtu"},
                 {"displacement", FileArgument::Kind::input, "displacement.csv of the beads"},
                 {"start", FileArgument::Kind::optional_input, "tensions.csv to start from: of the frame before"},
                 {"frames", FileArgument::Kind::optional_input,
                  "folder with frames.csv and displacement_0001.csv ... of a time series, each of which is fitted"},
                 {"kept", FileArgument::Kind::optional_input,
                  "output folder of a run that was alike but for single frames: the others' fits are kept"},
                 {"out", FileArgument::Kind::output_folder, "tensions.csv, adhesion_forces.csv, fit.json, VTK files"}}},
      argc, argv, fit);
}
