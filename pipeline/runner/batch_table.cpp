#include "pipeline/runner/batch_table.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <map>
#include <set>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/copies.h"
#include "pipeline/runner/hash_cache.h"
#include "pipeline/runner/run_cell.h"

namespace mbtfm::runner {

namespace {

std::string text_of(const Value& value) {
  return std::visit(
      [](const auto& v) {
        using V = std::decay_t<decltype(v)>;
        if constexpr (std::is_arithmetic_v<V> || std::is_same_v<V, std::string>)
          return files::field_of(v, 0);
        else
          return listed(v);
      },
      value);
}

/// Those of the cell as it is now; where that cannot be read, of both kinds: records of either may be there.
CellStages stages_or_all(const fs::path& cell) {
  try {
    return stages_of(cell, read_image_names(cell));
  } catch (const InputError&) {
    CellStages all;
    all.stages = all_stages();
    return all;
  }
}

/// What became of a cell.
enum class CellState { fine, cautions, not_usable, copy, failed, not_run, not_seen };
constexpr auto words(CellState) {
  return std::array{"fine", "with cautions", "not usable", "copy", "failed", "not run", "skipped"};
}

struct BatchRow {
  std::string name = {};  ///< of its folder, below the batch's
  BatchCell cell = {};
  CellState state = CellState::fine;
  CellKind kind = {};
  std::string reason = {};  ///< why it is not fine
  std::vector<Finding> findings = {};
  std::map<std::string, Value> figures = {};     ///< by column
  std::vector<std::string> columns = {};         ///< of the figures, in their order
  std::optional<files::CellResult> result = {};  ///< of a cell with fibres
  std::string last_stage = {};                   ///< that the figures of other cells are of
};

const Value* figure_of(const BatchRow& row, const std::string& column) {
  const auto at = row.figures.find(column);
  return at == row.figures.end() ? nullptr : &at->second;
}

std::optional<double> number_of(const BatchRow& row, const char* figure) {
  const Value* value = figure_of(row, row.last_stage + "." + figure);
  const auto* number = value ? std::get_if<double>(value) : nullptr;
  return number ? std::optional(*number) : std::nullopt;
}

/// The first of the folders above the cell, as `mbtfm stats --condition-from folder` has it; empty: there is none.
std::string condition_of(const BatchRow& row) {
  const fs::path name(row.name);
  return std::distance(name.begin(), name.end()) > 1 ? name.begin()->string() : "";
}

files::Columns<BatchRow> tension_column(FibreType type) {
  return {std::string(name_of(type)) + "_tension_nN",
          [type](const BatchRow& row) -> std::optional<double> {
            if (!row.result || !row.result->types.contains(type)) return std::nullopt;
            return row.result->types.at(type).mean_nN;
          },
          files::kResult};
}

/// A figure of the fit; of a cell in space or a sheet what its last stage reported.
files::Columns<BatchRow> result_column(const char* name, double FitSummary::*of) {
  return {name,
          [name, of](const BatchRow& row) -> std::optional<double> {
            return row.result ? std::optional(row.result->fit.*of) : number_of(row, name);
          },
          files::kResult};
}

files::Columns<BatchRow> cell_column() { return {"cell", &BatchRow::name}; }

files::Table<BatchRow> batch_table() {
  using R = files::CellResult;
  return {
      .file = "batch.csv",
      .columns = {
          cell_column(),
          {"condition", condition_of},
          {"state", [](const BatchRow& row) { return std::string(name_of(row.state)); }},
          {"worst_finding",
           [](const BatchRow& row) {
             const Finding* worst = worst_of(row.findings);
             return worst ? worst->id : std::string();
           }},
          result_column("total_force_nN", &FitSummary::total_force_nN),
          {"total_force_sigma_nN",
           [](const BatchRow& row) {
             return row.result ? row.result->total_error_nN : number_of(row, "total_force_sigma_nN");
           },
           files::kResult},
          tension_column(FibreType::dorsal),
          tension_column(FibreType::arc),
          tension_column(FibreType::ventral),
          tension_column(FibreType::edge),
          tension_column(FibreType::unclassified),
          {"fibres", files::member(&BatchRow::result, &R::n_fibres)},
          {"uncertain", files::member(&BatchRow::result, &R::n_uncertain)},
          result_column("relative_l2", &FitSummary::relative_l2),
          result_column("expected_relative_l2", &FitSummary::expected_relative_l2),
          {"first_force_nN", files::member(&BatchRow::result, &R::over_time, &files::ForceOverTime::first_nN),
           files::kResult},
          {"last_force_nN", files::member(&BatchRow::result, &R::over_time, &files::ForceOverTime::last_nN),
           files::kResult},
          {"largest_force_change_nN",
           files::member(&BatchRow::result, &R::over_time, &files::ForceOverTime::largest_change_nN), files::kResult},
          {"reason", &BatchRow::reason}}};
}

files::Table<BatchRow> whole_table() {
  return {.file = "batch_all.csv",
          .columns = {cell_column(),
                      {"exit_code", files::member(&BatchRow::cell, &BatchCell::exit_code)},
                      {"seconds", files::member(&BatchRow::cell, &BatchCell::seconds), files::kResult},
                      {"message", files::member(&BatchRow::cell, &BatchCell::message)},
                      {"failed_stage", files::member(&BatchRow::cell, &BatchCell::failed_stage)},
                      {"findings", [](const BatchRow& row) { return open_ids(row.findings); }}}};
}

files::Columns<BatchRow> figure_column(const std::string& name) {
  return {name, [name](const BatchRow& row) {
            const Value* figure = figure_of(row, name);
            return figure ? text_of(*figure) : std::string();
          }};
}

CellState state_by(const std::vector<Finding>& findings) {
  if (std::ranges::any_of(findings, spoils_cell)) return CellState::not_usable;
  return has_open(findings) ? CellState::cautions : CellState::fine;
}

/// What the stages of the cell say of it.
BatchRow row_of(const BatchCell& cell, const fs::path& folder, const std::vector<std::string>& only) {
  BatchRow row{.name = cell.cell.lexically_relative(folder).generic_string(), .cell = cell, .reason = cell.message};
  if (cell.cell == folder) row.name = fs::weakly_canonical(cell.cell).filename().string();
  row.state = cell.is_left_undone ? CellState::not_run : CellState::failed;
  if (cell.exit_code != 0) return row;  // what it has on disk may be of an earlier run
  const CellStages of = stages_or_all(cell.cell);
  row.kind = of.kind;
  for (const Stage& stage : of.stages) {
    if (!is_asked(stage, only)) continue;
    row.last_stage = stage.name;
    const auto record = report_of(cell.cell, stage);
    if (!record) continue;
    row.findings.insert(row.findings.end(), record->findings.begin(), record->findings.end());
    for (const auto& [name, value] : record->figures) {
      row.columns.push_back(stage.name + "." + name);
      row.figures[row.columns.back()] = value;
    }
  }
  row.state = state_by(row.findings);
  if (row.state == CellState::not_usable) row.reason = "not usable, as " + worst_of(row.findings)->id + " says";
  try {
    const bool is_fitted = has_fibres(of.kind) && is_asked(of.stages.back(), only);
    if (is_fitted && files::is_own_file(cell.cell / "4_fit/fit.json")) row.result = files::read_cell_result(cell.cell);
  } catch (const InputError& error) {  // changed by hand
    row.state = CellState::failed;
    row.reason = error.what();
  }
  return row;
}

/// The field of the beads that the cell was found from, and its outline in it.
CellInField field_of(const BatchRow& row, const char* field) {
  CellInField cell;
  const fs::path outline = row.cell.cell / "1_segment/outline.csv";
  try {
    if (files::is_own_file(outline)) cell.outline_um = files::read_outline(outline).front();
    HashCache hashes(row.cell.cell);
    const Hashes found = hashes.hash({field});
    // of a sheet whose outline the stages alone read nobody knows here whether another one lies beside it
    if (!found.empty() && (is_in_space(row.kind) || !cell.outline_um.empty()))
      cell.field_sha256 = found.begin()->second;
  } catch (const InputError&) {  // then it is a copy of nothing
  }
  return cell;
}

void mark_copies(std::vector<BatchRow>& rows) {
  const auto field_file = [](const BatchRow& row) {
    return is_in_space(row.kind) ? "2_track/displacement_3d.csv" : "2_track/displacement.csv";
  };
  std::vector<CellInField> cells;
  for (const BatchRow& row : rows)
    cells.push_back(row.state < CellState::not_usable ? field_of(row, field_file(row)) : CellInField{});
  const auto originals = originals_of(cells);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!originals[i]) continue;
    rows[i].state = CellState::copy;
    rows[i].reason = why_a_copy(rows[*originals[i]].name, field_file(rows[i]), cells[i]);
  }
}

std::string counts_of(const std::vector<BatchRow>& rows) {
  std::map<CellState, int> n_of;
  for (const BatchRow& row : rows) ++n_of[row.state];
  int n_done = 0;
  std::string done, others;
  for (const auto& [state, n] : n_of) {
    std::string& text = state < CellState::failed ? done : others;
    const char* const between = state < CellState::failed ? ", " : "; ";
    text += (text.empty() ? "" : between) + std::to_string(n) + " " + name_of(state);
    if (state < CellState::failed) n_done += n;
  }
  return std::to_string(n_done) + " done" + (done.empty() ? "" : ": " + done) + (others.empty() ? "" : "; " + others);
}

/// A line for each that nobody should count; those that failed have a table of their own.
std::string not_to_count(const std::vector<BatchRow>& rows) {
  std::string lines;
  for (const BatchRow& row : rows)
    if (row.state == CellState::copy || row.state == CellState::not_usable)
      lines += "\n  " + row.name + ": " + row.reason;
  return lines;
}

}  // namespace

std::string last_summary(const fs::path& cell, const std::vector<std::string>& only) {
  std::string summary;
  for (const Stage& stage : stages_or_all(cell).stages) {
    if (!is_asked(stage, only)) continue;
    const auto record = report_of(cell, stage);
    if (record && !record->summary.empty()) summary = record->summary;
  }
  return summary;
}

std::string verdict_on(const fs::path& cell, const std::vector<std::string>& only) {
  const BatchRow row = row_of({.cell = cell}, cell, only);
  const std::string state = row.state == CellState::not_usable ? "NOT USABLE" : name_of(row.state);
  return state + (has_open(row.findings) ? " (" + open_ids(row.findings) + ")" : "");
}

BatchCounts write_batch_tables(const fs::path& folder, const std::vector<BatchCell>& cells,
                               const std::vector<SkippedFolder>& skipped, const std::vector<std::string>& only) {
  files::Table<BatchRow> all = whole_table();
  std::vector<BatchRow> rows;
  for (const BatchCell& cell : cells) rows.push_back(row_of(cell, folder, only));
  mark_copies(rows);
  std::set<std::string> columns;
  for (const BatchRow& row : rows)
    for (const std::string& column : row.columns)
      if (columns.insert(column).second) all.columns.push_back(figure_column(column));
  files::write_whole(folder / "batch_all.csv", text_of(all, rows));
  for (const SkippedFolder& s : skipped)
    rows.push_back(
        {.name = s.folder.lexically_relative(folder).generic_string(), .state = CellState::not_seen, .reason = s.why});
  files::write_whole(folder / "batch.csv", text_of(batch_table(), rows));
  return {.counts = counts_of(rows), .not_to_count = not_to_count(rows)};
}

std::string failure_table(const fs::path& folder, const std::vector<BatchCell>& cells) {
  std::vector<std::array<std::string, 4>> rows = {{"cell", "stage", "ended", "cause"}};
  for (const BatchCell& cell : cells) {
    if (cell.exit_code == 0) continue;
    rows.push_back({cell.cell.lexically_relative(folder).generic_string(),
                    cell.failed_stage.empty() ? "-" : cell.failed_stage, cell.how, cell.message});
  }
  if (rows.size() == 1) return {};
  std::array<std::size_t, 4> widths{};
  for (const auto& row : rows)
    for (std::size_t k = 0; k + 1 < row.size(); ++k) widths[k] = std::max(widths[k], row[k].size());
  std::ostringstream text;
  for (const auto& row : rows)
    for (std::size_t k = 0; k < row.size(); ++k)
      text << (k == 0 ? "\n  " : "   ") << std::left << std::setw(static_cast<int>(widths[k])) << row[k];
  return text.str();
}

std::string pages_of_tables() {
  files::Table<BatchRow> all = whole_table();
  all.columns.push_back(figure_column("stage.figure"));
  return page_of(batch_table()) + page_of(all);
}

}  // namespace mbtfm::runner
