#include "mbtfm/fit/files.h"

#include <algorithm>
#include <string>
#include <vector>

#include "mbtfm/fit/checks.h"
#include "mbtfm/fit/fit_cell.h"
#include "mbtfm/tensions/findings.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/second_placement.h"
#include "mbtfm/tensions/tables.h"
#include "mbtfm/tractions/neighbour_noise.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/named_array.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "substrate/gel_vtu.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

std::vector<SeriesFrame> read_frames(stage::StageContext& context) {
  if (!context.has_input("frames")) return {};
  std::vector<SeriesFrame> frames = read_series(context.input("frames", {"frames.csv"}));
  std::vector<std::string> names;
  for (const SeriesFrame& frame : frames)
    if (frame.refused.empty()) names.push_back(files::displacement_of_frame(frame.frame));
  context.input("frames", names);
  return frames;
}

/// That there is a frame before counts where its tensions are not asked for, too.
std::optional<std::vector<Tension>> read_before(stage::StageContext& context, Switch time_coupling) {
  if (!context.has_input("start")) return {};
  if (time_coupling == Switch::off) return std::vector<Tension>{};
  return files::read_tensions(context.input("start"));
}

std::optional<Cell> read_second_placement(stage::StageContext& context, const Cell& cell) {
  std::optional<Cell> second = second_placement(context.inputs_.at("cell"), cell);
  if (second) context.input("cell", kSecondPlacementFiles);
  return second;
}

files::NamedArray most_informed_array(const Influence& influence) {
  return files::array_of("informs_fibre_id", influence.most_informed);
}

/// What the loss and the region leave of each bead.
files::NamedArray weight_array(const LinearData& data) {
  files::NamedArray array{.name = "weight"};
  for (Index b = 0; b < data.bead_weight.size(); ++b)
    array.values.push_back(data.weight_per_um[2 * b] > 0 ? data.bead_weight[b] : 0);
  return array;
}

void write_checks(stage::StageContext& context, const ModelChecks& checks, const EnsembleFit& fit) {
  const auto out = [&](const char* file) { return context.output("out", file); };
  files::write(out("correlations.csv"), correlation_table(), correlation_rows(fit));
  files::write(out("models.csv"), model_table(), checks.models);
  files::write(out("fibres_left_out.csv"), fibre_left_out_table(), checks.left_out);
  files::write(out("missing_fibres.csv"), files::missing_fibre_table(), checks.missing_fibres);
  files::write(out("missing_adhesions.csv"), files::missing_adhesion_table(), checks.missing_adhesions);
  if (checks.drawn) files::write(out("cross_validation.csv"), draw_table(), draw_rows(*checks.drawn));
}

/// The first network, contracted by the mean tensions.
void write_contracted(const Path& file, const cables::CableNetwork& network, const EnsembleFit& fit) {
  std::vector<double> tensions;
  for (const Estimate& e : fit.tensions.nN) tensions.push_back(e.value);
  const cables::Equilibrium& nearby = cables::equilibrium_of(*fit.meshes.front().fit.trial.rest);
  const cables::Equilibrium e = network.equilibrium(tensions, nearby.positions_um);
  files::write_contracted_network(file, network.network(), e.positions_um, e.link_force_nN, e.link_states);
}

void write_found(stage::StageContext& context, const FittedCell& fitted) {
  const Found& found = fitted.found;
  const Cell& cell = fitted.ready.scene.cell;
  files::write_tensions(context.output("out", "tensions.csv"), found.tensions, cell.fibres);
  // of those that the segmentation has; missing_adhesions.csv has the others
  std::vector<AdhesionForce> forces = found.forces;
  forces.resize(fitted.seen.adhesions.size());
  files::write_adhesion_forces(context.output("out", "adhesion_forces.csv"), forces, fitted.seen.adhesions);
  files::write_fit_summary(context.output("out", "fit.json"), found.summary, cell.fibres);
  write_contracted(context.output("out", "contracted.vtu"), fitted.ready.networks.front(), fitted.fit);
  write_tractions_vtp(context.output("out", "tractions.vtp"), cell, found.forces);
}

void write_fields(stage::StageContext& context, const FittedCell& cell, const DisplacementField& tracked) {
  files::write_displacement(context.output("out", "fitted_displacement.csv"), cell.fields.fitted);
  files::write_displacement(context.output("out", "displacement_without_fibres.csv"), cell.fields.without_fibres);
  write_displacement_vtp(context.output("out", "displacement.vtp"), tracked, cell.fields.fitted,
                         {most_informed_array(cell.checks.influence), weight_array(cell.fit.data)});
}

void write_frames(stage::StageContext& context, const FittedCell& cell) {
  if (cell.frames.empty()) return;
  const std::vector<Fibre>& fibres = cell.ready.scene.cell.fibres;
  const std::optional<double> interval_s = cell.parameters.fit.frame_interval_s;
  write_tracks(context.output("out", "tracks.csv"), cell.frames, fibres, interval_s);
  tensions::write_frames(context.output("out", "frames.csv"), cell.frames, interval_s);
  files::write_text(context.output("out", "tracks.svg"), series_picture(cell.frames, fibres, interval_s));
}

void write_surface(stage::StageContext& context, const FittedCell& cell) {
  std::vector<Vec2> forces_nN;
  for (const AdhesionForce& f : cell.found.forces) forces_nN.push_back(f.force_nN);
  substrate::write_substrate_vtu(context.output("out", "substrate.vtu"), *cell.ready.gel,
                                 substrate::ellipses_of(cell.ready.scene.cell.adhesions), forces_nN,
                                 cell.parameters.fit.surface_lines);
}

}  // namespace

Inputs read_inputs(stage::StageContext& context, const Parameters& parameters) {
  Inputs inputs{.cell = files::read_cell(context.input("cell", files::kCellFiles)),
                .network = files::read_network(context.input("network")),
                .network_file = context.inputs_.at("network").string(),
                .beads = files::read_displacement(context.input("displacement"))};
  inputs.n_flagged = static_cast<int>(std::erase_if(inputs.beads, [](const Bead& bead) { return !bead.flag.empty(); }));
  inputs.frames = read_frames(context);
  inputs.before = read_before(context, parameters.effects.time_coupling);
  inputs.second_placement = read_second_placement(context, inputs.cell);
  if (!inputs.frames.empty() && context.has_input("kept")) inputs.known_frames = read_fits(context.inputs_.at("kept"));
  return inputs;
}

void write_results(stage::StageContext& context, const FittedCell& cell, const DisplacementField& tracked) {
  write_checks(context, cell.checks, cell.fit);
  write_found(context, cell);
  write_fields(context, cell, tracked);
  write_frames(context, cell);
  context.progress(0.95, "surface of the gel");
  write_surface(context, cell);
  if (cell.parameters.explain)
    files::write(context.output("out", "effects_left_out.csv"), change_table(), change_rows(cell.changes, cell.fit));
}

namespace {

/// Those in the outline's box and a little around it: a field far larger than the cell would fill the disk.
std::vector<GroundPatch> near(const Polygon& outline_um, std::vector<GroundPatch> patches) {
  constexpr double kMargin_um = 5;  // as around the report's maps
  const Extent box = extent_of(outline_um);
  std::erase_if(patches, [&](const GroundPatch& patch) {
    const Vec2 p = patch.position_um;
    return p.x < box.low_um.x - kMargin_um || p.x > box.high_um.x + kMargin_um || p.y < box.low_um.y - kMargin_um ||
           p.y > box.high_um.y + kMargin_um;
  });
  return patches;
}

}  // namespace

void write_usual_method(stage::StageContext& context, const Inputs& inputs, const Gel& gel) {
  // no adhesions: the errors of their forces would take longer than all else
  tractions::TractionInputs given{
      .beads = inputs.beads, .gel = gel, .adhesions = {}, .outline_um = inputs.cell.outline_um};
  tractions::assume_noise_um(given.beads);
  const tractions::TractionParameters parameters;
  Figures figures;
  try {
    const tractions::Reconstruction r = tractions::reconstruct(given, parameters, context.threads);
    tractions::write_tractions(context.output("out", "fttc.csv"), near(given.outline_um, r.patches));
    figures = tractions::summary_of(r, tractions::sums_of(r, given, parameters.grow_um));
    figures.emplace_back("lambda_by", std::string(name_of(parameters.lambda_by)));
  } catch (const InvalidData& e) {
    figures = {{"obstacle", std::string(e.what())}};
  } catch (const NotSolved& e) {
    figures = {{"obstacle", std::string(e.what())}};
  }
  files::write_figures(context.output("out", "fttc.json"), figures);
}

using namespace tensions;

namespace {

std::string of_series(const std::vector<FrameFit>& frames) {
  if (frames.empty()) return "";
  const auto n_refused = std::ranges::count_if(frames, [](const FrameFit& f) { return !f.refused.empty(); });
  return "; " + std::to_string(frames.size()) + " frames" +
         (n_refused > 0 ? ", " + std::to_string(n_refused) + " of them without a fit (see frames.csv)" : "");
}

std::string summary_line(const FittedCell& cell) {
  if (!cell.fit.report.converged) return cell.fit.report.reason;
  const std::vector<Tension>& tensions = cell.found.tensions;
  std::string line = std::to_string(tensions.size() - 1) + " fibre tensions, total force " +
                     brief(cell.found.summary.total_force_nN) + " nN, relative L2 " +
                     brief(cell.found.summary.relative_l2) + of_series(cell.frames);
  const std::vector<std::string> together = names_of_groups(cell.fit);
  if (!together.empty()) line += "; resolved only as a sum: fibres " + listed(together);
  const auto n_unidentifiable = std::ranges::count(tensions, false, &Tension::identifiable);
  if (n_unidentifiable > 0)
    line += "; " + std::to_string(n_unidentifiable) + (n_unidentifiable == 1 ? " tension" : " tensions") +
            " not identifiable";
  const int n_flagged = cell.ready.scene.n_flagged;
  if (n_flagged > 0) line += "; " + std::to_string(n_flagged) + " flagged beads left out";
  return line;
}

std::vector<Finding> all_findings(const FittedCell& c) {
  std::vector<Finding> findings =
      findings_of({c.fit, c.fit.data, c.seen, c.found.summary, c.found.tensions, c.checks.missing_fibres,
                   c.checks.missing_adhesions, c.motions.common, c.motions.curved, c.motions.placement, c.ready.beyond,
                   c.ready.decisions.strain,
                   has_far_beads(c.fit.data, c.ready.scene.cell.outline_um, c.parameters.fit.far_distance_um)});
  for (const auto& [symptom, reading] :
       {std::pair(Symptom::field_smoothed, c.smoothing), std::pair(Symptom::read_otherwise, c.reading)}) {
    if (!reading) continue;
    if (auto found = noticed_reading(symptom, *reading)) findings.insert(findings.begin(), std::move(*found));
  }
  if (!c.parameters.gel.youngs_modulus_sigma_kPa)
    findings.insert(findings.begin(), *noticed(Symptom::modulus_error_unknown, 1));
  return findings;
}

}  // namespace

StageReport report_of(const FittedCell& cell) {
  StageReport report{.converged = cell.fit.report.converged,
                     .summary = summary_line(cell),
                     .figures = cell.found.summary.more,
                     .effects = cell.effects,
                     .findings = all_findings(cell)};
  report.figures.emplace_back("error_budget_s", cell.found.budget_s);
  for (const auto& figure : cell.ready.gel->figures()) report.figures.push_back(figure);
  return report;
}

}  // namespace mbtfm::fit
