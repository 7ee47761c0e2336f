#include "pipeline/runner/batch_table.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/json.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/run_cell.h"

namespace mbtfm::runner {

namespace {

/// What a stage that has ended says of itself.
struct StageSays {
  std::string summary;
  std::vector<std::pair<std::string, std::string>> figures = {};  ///< name, value
  std::vector<Finding> findings;
};

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

/// None where there is no record, or a damaged one: the run itself tells.
std::optional<StageSays> record_of(const fs::path& cell, const Stage& stage) {
  const fs::path file = record_file_of(cell, stage);
  if (!files::is_own_file(file)) return std::nullopt;
  try {
    const files::JsonRecord record(file, "a stage's record");
    StageSays says{.summary = record.text_or("summary", ""), .findings = files::findings_of(record)};
    for (const auto& [name, value] : record.at("figures").members()) {
      // null: not a number, in JSON
      says.figures.emplace_back(name, value.json().is_null() ? std::string() : text_of(value.figure()));
    }
    return says;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// Those of the cell as it is now; where that cannot be read, of both kinds: records of either may be there.
std::vector<Stage> stages_told_of(const fs::path& cell) {
  try {
    return stages_of(cell, read_image_names(cell)).stages;
  } catch (const InputError&) {
    return all_stages();
  }
}

struct BatchRow {
  BatchCell cell = {};
  std::vector<Finding> findings = {};
  std::map<std::string, std::string> figures = {};  ///< by column
};

files::Table<BatchRow> batch_table(const fs::path& folder) {
  return {
      .file = "batch.csv",
      .row = "each cell of a batch",
      .columns = {{"cell", "its folder, below the batch's",
                   [folder](const BatchRow& row) { return row.cell.cell.lexically_relative(folder).generic_string(); }},
                  {"exit_code", "of `mbtfm run`", files::member(&BatchRow::cell, &BatchCell::exit_code)},
                  {"seconds", "it took", files::member(&BatchRow::cell, &BatchCell::seconds), files::kResult},
                  {"message", "why it failed", files::member(&BatchRow::cell, &BatchCell::message)},
                  {"failed_stage", "where it failed", files::member(&BatchRow::cell, &BatchCell::failed_stage)},
                  {"findings", "that are open", [](const BatchRow& row) { return open_ids(row.findings); }}}};
}

files::Columns<BatchRow> figure_column(const std::string& name) {
  return {name, "a figure that a stage reported", [name](const BatchRow& row) {
            const auto figure = row.figures.find(name);
            return figure == row.figures.end() ? std::string() : figure->second;
          }};
}

}  // namespace

std::string last_summary(const fs::path& cell, const std::vector<std::string>& only) {
  std::string summary;
  for (const Stage& stage : stages_told_of(cell)) {
    if (!is_asked(stage, only)) continue;
    const auto record = record_of(cell, stage);
    if (record && !record->summary.empty()) summary = record->summary;
  }
  return summary;
}

void write_batch_table(const fs::path& file, const fs::path& folder, const std::vector<BatchCell>& cells,
                       const std::vector<std::string>& only) {
  files::Table<BatchRow> table = batch_table(folder);
  std::set<std::string> columns;
  std::vector<BatchRow> rows;
  for (const BatchCell& cell : cells) {
    BatchRow& row = rows.emplace_back(BatchRow{.cell = cell});
    if (cell.exit_code != 0) continue;  // what it has on disk may be of an earlier run
    for (const Stage& stage : stages_told_of(cell.cell)) {
      if (!is_asked(stage, only)) continue;
      const auto record = record_of(cell.cell, stage);
      if (!record) continue;
      row.findings.insert(row.findings.end(), record->findings.begin(), record->findings.end());
      for (const auto& [name, value] : record->figures) {
        const std::string column = stage.name + "." + name;
        row.figures[column] = value;
        if (columns.insert(column).second) table.columns.push_back(figure_column(column));
      }
    }
  }
  files::write_whole(file, text_of(table, rows));
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
  files::Table<BatchRow> table = batch_table({});
  table.columns.push_back(figure_column("stage.figure"));
  return page_of(table);
}

}  // namespace mbtfm::runner
