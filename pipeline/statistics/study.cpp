#include "pipeline/statistics/study.h"

#include <algorithm>
#include <map>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/listed.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/json.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/sheet_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/report/space_results.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/copies.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/statistics/descriptive.h"
#include "pipeline/statistics/review.h"

namespace mbtfm::statistics {
namespace {

std::optional<DisplacementField> field_where_there(const Path& file) {
  if (!files::is_own_file(file)) return std::nullopt;
  return files::read_displacement(file);
}

constexpr const char* kDisplacement = "2_track/displacement.csv";
constexpr const char* kOutline = "1_segment/outline.csv";
constexpr const char* kRun = "run.json";
constexpr const char* kUsual = "4_fit/fttc.json";
constexpr const char* kFitted = "4_fit/fitted_displacement.csv";
constexpr const char* kWithoutFibres = "4_fit/displacement_without_fibres.csv";

std::optional<files::JsonRecord> run_of(const Path& folder) {
  if (!files::is_own_file(folder / kRun)) return std::nullopt;
  return files::JsonRecord(folder / kRun, "a run.json of mbtfm run");
}

/// The segmented one; of a mask or a selection, which are read by the stages alone, the box around the sheet.
Polygon outline_of_sheet(const Path& folder) {
  if (files::is_own_file(folder / kOutline)) {
    Polygon outer;
    for (const files::OutlinePoint& p : files::read(folder / kOutline, files::outline_table()))
      if (p.ring == 0) outer.push_back(p.position_um);
    return outer;
  }
  const files::CsvTable nodes(folder / "3_sheet/sheet.csv");
  std::vector<Vec2> places;
  for (int row = 0; row < nodes.n_rows(); ++row)
    places.push_back({nodes.number(row, "x_um"), nodes.number(row, "y_um")});
  const auto [low, high] = extent_of(places);
  return {low, {high.x, low.y}, high, {low.x, high.y}};
}

/// Findings, and whether the last stage came to its end.
void read_end(const Path& folder, const char* stage, StudyCell& cell) {
  cell.fit.converged = true;  // where nobody says otherwise: without run.json the stage was run by hand
  if (const auto run = run_of(folder)) {
    cell.findings = findings_of(*run);
    cell.fit.converged = run->at("stages").at(stage).is_true_or("converged", true);
  }
}

StudyCell read_study_sheet(const Path& folder, const std::string& name) {
  StudyCell c{.name = name, .sheet = files::read_sheet_summary(folder / "3_sheet")};
  c.cell.outline_um = outline_of_sheet(folder);
  c.fit.relative_l2 = c.sheet->relative_l2;
  c.fit.expected_relative_l2 = c.sheet->expected_relative_l2;
  read_end(folder, "sheet", c);
  return c;
}

StudyCell read_study_cell_in_space(const Path& folder, const std::string& name) {
  const report::SpaceResults results = report::read_space_results(folder);
  StudyCell c{.name = name,
              .space = SpaceFigures{.method = results.texts.at("method"),
                                    .total_force_nN = results.number("total_force_nN"),
                                    .total_force_sigma_nN = results.find("total_force_sigma_nN"),
                                    .strain_energy_fJ = results.number("strain_energy_fJ"),
                                    .contractile_moment_nN_um = results.find("contractile_moment_nN_um"),
                                    .contractile_moment_sigma_nN_um = results.find("contractile_moment_sigma_nN_um"),
                                    .normal_force_nN = results.number("normal_force_nN"),
                                    .largest_traction_kPa = report::largest_kPa(report::map_of(results)),
                                    .net_force_nN = norm(results.vector("net_force", "nN")),
                                    .net_moment_nN_um = norm(results.vector("moment", "nN_um")),
                                    .resolution_um = results.find("median_resolution_um")}};
  for (const PartForce& f : results.forces)
    c.space->adhesions.push_back({f.adhesion_id, norm(f.force_nN), f.magnitude_sigma_nN});
  c.cell.outline_um = results.outline_um;
  c.fit.relative_l2 = results.number("relative_l2");
  c.fit.noise_um = results.number("noise_um");
  read_end(folder, "traction", c);
  return c;
}

StudyCell read_study_cell(const Path& folder, const std::string& name, const StudyParameters& parameters) {
  StudyCell c{.name = name,
              .cell = files::read_cell(folder / "1_segment"),
              .forces = files::read_adhesion_forces(folder / "4_fit/adhesion_forces.csv"),
              .tensions = files::read_tensions(folder / "4_fit/tensions.csv"),
              .fit = files::read_fit_summary(folder / "4_fit/fit.json")};
  std::set<int> ids;
  for (const Adhesion& a : c.cell.adhesions) ids.insert(a.adhesion_id);
  for (const AdhesionForce& f : c.forces) {
    if (ids.contains(f.adhesion_id)) continue;
    throw InputError((folder / "4_fit/adhesion_forces.csv").string(), "adhesions of 1_segment/adhesions.csv",
                     "adhesion " + std::to_string(f.adhesion_id),
                     "the segmentation changed after the fit: mbtfm run " + folder.string());
  }
  if (files::is_own_file(folder / kUsual))
    if (const auto force = files::JsonRecord(folder / kUsual, "figures of FTTC").find("total_force_nN"))
      c.fttc_force_nN = force->number();
  if (const auto run = run_of(folder)) c.findings = findings_of(*run);
  if (parameters.list) return c;
  c.directions = directions_of(c.cell, {.measured = field_where_there(folder / kDisplacement),
                                        .fitted = field_where_there(folder / kFitted),
                                        .without_fibres = field_where_there(folder / kWithoutFibres),
                                        .noise_um = c.fit.noise_um,
                                        .near_um = parameters.near_adhesion_um});
  return c;
}

/// Why a cell cannot enter, as its folder shows; empty: it can.
std::string obstacle(const Path& cell, CellKind kind) {
  for (const std::string& file : in_study(kind).files)
    if (!files::is_own_file(cell / file)) return "no fit: " + file + " is not there";
  return {};
}

StudyCell read_cell_of_kind(CellKind kind, const Path& folder, const std::string& name,
                            const StudyParameters& parameters) {
  if (has_fibres(kind)) return read_study_cell(folder, name, parameters);
  return is_sheet(kind) ? read_study_sheet(folder, name) : read_study_cell_in_space(folder, name);
}

/// The field of beads that it was found from.
const char* field_of(const StudyCell& cell) { return is_in_space(cell.kind()) ? report::kBeadsInSpace : kDisplacement; }

/// A folder that was copied is no further cell: of those of one field and place the first enters.
void leave_out_copies(const std::vector<Path>& folders, const std::vector<std::string>& names,
                      const std::vector<std::optional<StudyCell>>& read, std::vector<std::string>& reasons) {
  std::vector<runner::CellInField> cells(folders.size());
  for (std::size_t i = 0; i < folders.size(); ++i) {
    if (!reasons[i].empty()) continue;
    const Path field = folders[i] / field_of(*read[i]);
    if (files::is_own_file(field)) cells[i] = {files::sha256_of_file(field), read[i]->cell.outline_um};
  }
  const auto originals = runner::originals_of(cells);
  for (std::size_t i = 0; i < folders.size(); ++i)
    if (originals[i]) reasons[i] = runner::why_a_copy(names[*originals[i]], field_of(*read[i]), cells[i]);
}

/// Those that are asked for come first, in that order.
/// @throws UsageError where one is asked for that no cell has
void number_conditions(Study& study, const std::vector<std::string>& condition_of_cell, const std::string& order) {
  std::set<std::string, decltype(&files::is_before)> names(condition_of_cell.begin(), condition_of_cell.end(),
                                                           &files::is_before);  // 2 kPa before 10 kPa
  for (const std::string& asked : files::parts_of(order)) {
    const auto name = std::ranges::find(names, files::folded(asked), files::folded);
    if (name == names.end())
      throw UsageError("stats.conditions: no cell that enters is of the condition '" + asked + "'; " +
                       (names.contains("") && names.size() == 1
                            ? "none has one: give a --table with a column 'condition', or --condition_from folder"
                            : "there are " + listed(std::vector<std::string>(names.begin(), names.end()))));
    study.conditions.push_back(*name);
    names.erase(name);
  }
  study.conditions.insert(study.conditions.end(), names.begin(), names.end());
  for (std::size_t i = 0; i < study.cells.size(); ++i) {
    const auto at = std::find(study.conditions.begin(), study.conditions.end(), condition_of_cell[i]);
    study.cells[i].condition = static_cast<int>(at - study.conditions.begin());
  }
}

/// Why the findings of a cell keep it out; empty: they do not.
std::string excluded_by_finding(const StudyCell& cell, const std::vector<std::string>& ids, bool with_bad) {
  const auto bad = std::ranges::find_if(cell.findings, spoils_cell);
  if (bad != cell.findings.end() && !with_bad) return "not usable, as " + bad->id + " says (stats.with_bad)";
  for (const Finding& finding : cell.findings)
    if (is_open(finding) && std::ranges::find(ids, finding.id) != ids.end())
      return "the finding " + finding.id + " is open (stats.exclude_findings)";
  return {};
}

/// @throws UsageError where an id is none
std::vector<std::string> excluding_findings(const StudyParameters& parameters) {
  std::vector<std::string> ids = files::parts_of(parameters.exclude_findings);
  for (std::string& id : ids) {
    id = present_id(id);
    if (std::ranges::none_of(kinds_of_findings(), [&](const KindOfFinding& kind) { return kind.id == id; }))
      throw UsageError("stats.exclude_findings: there is no finding '" + id + "': docs/findings.md lists them");
  }
  return ids;
}

/// A file may call identifiable what its interval does not know at all; its square must stay a number.
bool is_measured(const Tension& t) {
  constexpr double kAnything_nN = 1e6;  // a cell's whole force is some 1e3
  return t.identifiable && standard_error_nN(t).value_or(0) < kAnything_nN;
}

[[noreturn]] void no_cell_left(const Path& folder, const std::vector<LeftOutCell>& left_out) {
  std::map<std::string, int> n_of;
  for (const LeftOutCell& cell : left_out) ++n_of[cell.reason];
  std::vector<std::string> reasons;
  for (const auto& [reason, n] : n_of) reasons.push_back(std::to_string(n) + ": " + reason);
  constexpr std::size_t kListed = 5;
  if (reasons.size() > kListed) reasons.resize(kListed);
  throw InputError(folder.string(), "at least one finished cell that enters",
                   "none of " + std::to_string(left_out.size()) + (reasons.empty() ? "" : " (" + listed(reasons) + ")"),
                   "cells that are not finished: mbtfm batch " + folder.string() +
                       "; others: the table, or the parameters of mbtfm stats");
}

}  // namespace

void declare(stage::ParameterList& list, StudyParameters& parameters) {
  list.table("stats");
  list.add("condition_from", parameters.condition_from);
  list.add("conditions", parameters.conditions);
  list.add("replicate_from", parameters.replicate_from);
  list.add("exclude_findings", parameters.exclude_findings);
  list.add("primary", parameters.primary);
  list.add("primary_type", parameters.primary_type);
  list.add("with_not_converged", parameters.with_not_converged);
  list.add("list", parameters.list);
  list.add("with_bad", parameters.with_bad);
  list.add("weak_tension_nN", parameters.weak_tension_nN, Range::force_nN());
  list.add("strong_tension_nN", parameters.strong_tension_nN, Range::force_nN());
  list.add("near_adhesion_um", parameters.near_adhesion_um, Range::size_um());
  list.add("bootstrap_draws", parameters.bootstrap_draws, Range::between(100, 1000000));
  list.add("bootstrap_seed", parameters.bootstrap_seed);
  list.add("fibre_types", parameters.fibre_types, Range::between(3, 5));
}

std::vector<double> thresholds_nN(const StudyParameters& parameters) {
  if (parameters.weak_tension_nN == parameters.strong_tension_nN) return {parameters.weak_tension_nN};
  return {parameters.weak_tension_nN, parameters.strong_tension_nN};
}

int n_of_kind(const Study& study, CellKind kind) {
  return static_cast<int>(std::ranges::count_if(study.cells, [&](const StudyCell& c) { return c.kind() == kind; }));
}

int n_with_fibres(const Study& study) {
  return static_cast<int>(std::ranges::count_if(study.cells, [](const StudyCell& c) { return has_fibres(c.kind()); }));
}

const KindInStudy& in_study(CellKind kind) {
  static const std::array<KindInStudy, 3> all = {
      {{"cell",
        "cells",
        "stress-fibre tensions",
        PrimaryMeasure::tension,
        {{PrimaryMeasure::total_force, "total_force_nN"}},
        "Cells",
        "cells",
        "fibres",
        "",
        nullptr,
        {"1_segment/adhesions.csv", "1_segment/fibres.csv", "1_segment/fibre_points.csv", kOutline,
         "4_fit/tensions.csv", "4_fit/adhesion_forces.csv", "4_fit/fit.json"},
        {kDisplacement, kFitted, kWithoutFibres, kUsual, kRun}},
       {"cell",
        "cells",
        "forces",
        PrimaryMeasure::total_force,
        {{PrimaryMeasure::total_force, "space_force_nN"},
         {PrimaryMeasure::contractile_moment, "space_contractile_moment_nN_um"},
         {PrimaryMeasure::strain_energy, "space_strain_energy_fJ"}},
        "Cells in space",
        "cells_in_space",
        "adhesions",
        " of an adhesion",
        "study.how-to-read-space",
        {report::kBeadsInSpace, "3_surface/surface.vtp", "4_traction/traction.csv", "4_traction/traction.json"},
        {"4_traction/traction_adhesion_forces.csv", "1_segment/adhesions.csv", kOutline, kRun}},
       {"sheet",
        "sheets",
        "contraction",
        PrimaryMeasure::contraction,
        {{PrimaryMeasure::total_force, "sheet_force_nN"},
         {PrimaryMeasure::contraction, name_of(SheetQuantity::contraction)},
         {PrimaryMeasure::mean_tension, "mean_tension_nN_per_um"},
         {PrimaryMeasure::strain_energy, "strain_energy_fJ"}},
        "Sheets",
        "sheets",
        "parts",
        "",
        "study.how-to-read-sheets",
        {"3_sheet/sheet_fit.csv", "3_sheet/sheet.json", "3_sheet/sheet.csv"},
        {kDisplacement, kOutline, kRun}}}};
  return all.at(static_cast<std::size_t>(kind));
}

Study read_study(const Path& folder, const StudyParameters& parameters, const std::optional<Path>& table, int threads) {
  const runner::FoundCells found = parameters.list ? runner::search_cells(folder) : runner::find_cells(folder);
  const std::vector<Path>& folders = found.cells;
  std::vector<std::string> names;
  for (const Path& cell : folders) {
    const std::string name = cell.lexically_relative(folder).generic_string();
    names.push_back(name == "." ? fs::weakly_canonical(cell).filename().string() : name);
  }
  const CellNotes noted = notes_of(names, parameters.condition_from, parameters.replicate_from, table);
  const std::vector<CellNote>& notes = noted.of_cells;
  const std::vector<Review> reviews = reviews_of(folder, names, folders);
  const std::vector<std::string> excluding = excluding_findings(parameters);
  std::vector<std::optional<StudyCell>> read(folders.size());
  std::vector<std::string> reasons(folders.size());
  numerics::parallel_for(static_cast<int>(folders.size()), threads, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    reasons[i] = notes[i].reason_to_exclude;
    if (reasons[i].empty()) reasons[i] = reason_to_exclude(reviews[i]);
    if (!reasons[i].empty()) return;
    try {
      files::check_cell_folder(folders[i]);
      const CellKind kind = runner::stages_of(folders[i], runner::read_image_names(folders[i])).kind;
      reasons[i] = obstacle(folders[i], kind);
      if (!reasons[i].empty()) return;
      read[i] = read_cell_of_kind(kind, folders[i], names[i], parameters);
    } catch (const InputError& error) {
      reasons[i] = error.what();  // that cell's matter, not the study's
    }
    if (!reasons[i].empty()) return;
    read[i]->replicate = notes[i].replicate;
    if (!read[i]->fit.converged && !parameters.with_not_converged) reasons[i] = "the fit did not converge";
    if (reasons[i].empty()) reasons[i] = excluded_by_finding(*read[i], excluding, parameters.with_bad);
  });
  leave_out_copies(folders, names, read, reasons);
  Study study;
  study.folder = folder;
  study.warnings = noted.warnings;
  study.n_fibre_types = parameters.fibre_types;
  std::vector<std::string> condition_of_cell;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    if (!reasons[i].empty()) {
      study.left_out.push_back({names[i], notes[i].condition, reasons[i], reviews[i]});
      continue;
    }
    study.cells.push_back(std::move(*read[i]));
    take_review(reviews[i], study.cells.back(), study.warnings);
    condition_of_cell.push_back(notes[i].condition);
  }
  for (const runner::SkippedFolder& s : found.skipped)
    study.left_out.push_back({s.folder.lexically_relative(folder).generic_string(), "", s.why});
  if (study.cells.empty() && !parameters.list) no_cell_left(folder, study.left_out);
  number_conditions(study, condition_of_cell, parameters.conditions);
  return study;
}

const std::string& condition_of(const Study& study, const StudyCell& cell) { return study.conditions[cell.condition]; }

FibreType counted_type(const Study& study, FibreType type) {
  return study.n_fibre_types < 4 && type == FibreType::edge ? FibreType::ventral : type;
}

const Tension* tension_of(const StudyCell& cell, int fibre_id) {
  const auto found = std::ranges::find(cell.tensions, fibre_id, &Tension::fibre_id);
  return found == cell.tensions.end() ? nullptr : &*found;
}

std::vector<MeasuredFibre> measured_fibres(const StudyCell& cell) {
  std::vector<MeasuredFibre> fibres;
  for (const Fibre& fibre : cell.cell.fibres)
    if (const Tension* tension = tension_of(cell, fibre.fibre_id); tension && is_measured(*tension))
      fibres.push_back({&cell, &fibre, tension});
  return fibres;
}

std::vector<MeasuredFibre> measured_fibres(const Study& study) {
  std::vector<MeasuredFibre> fibres;
  for (const StudyCell& cell : study.cells)
    for (const MeasuredFibre& fibre : measured_fibres(cell)) fibres.push_back(fibre);
  return fibres;
}

bool is_network_known(const StudyCell& cell) {
  const Tension* network = tension_of(cell, 0);
  return !network || network->identifiable;
}

std::optional<double> standard_error_nN(const Tension& t) {
  if (!t.high_nN) return std::nullopt;
  const bool is_whole = t.low_nN && *t.low_nN > 0;
  const double error = is_whole ? (*t.high_nN - *t.low_nN) / (2 * kNormal95) : (*t.high_nN - t.tension_nN) / kNormal95;
  return error > 0 ? std::optional(error) : std::nullopt;
}

}  // namespace mbtfm::statistics
