#include "pipeline/runner/batch_table.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/json.h"
#include "pipeline/runner/stages.h"

namespace mbtfm::runner {
namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

/// The record of a stage that has ended; null where there is none. A damaged one counts as none: the run itself tells.
ordered_json record_of(const fs::path& cell, const Stage& stage) {
  const fs::path file = cell / stage.folder / "record.json";
  if (!fs::is_regular_file(file)) return {};
  ordered_json record = ordered_json::parse(read_text(file), nullptr, /*allow_exceptions=*/false);
  return record.is_object() && record.contains("figures") ? record : ordered_json{};
}

std::string text_of(const ordered_json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return shortest(value.get<double>());
  return value.dump();
}

}  // namespace

std::string last_summary(const fs::path& cell, const std::vector<std::string>& only) {
  std::string summary;
  for (const Stage& stage : stages()) {
    if (!is_asked(stage, only)) continue;
    const ordered_json record = record_of(cell, stage);
    if (record.is_object()) summary = record.value("summary", summary);
  }
  return summary;
}

void write_batch_table(const fs::path& file, const fs::path& folder, const std::vector<BatchCell>& cells,
                       const std::vector<std::string>& only) {
  std::vector<std::string> header = {"cell", "exit_code", "seconds", "message", "failed_stage"};
  const std::size_t n_fixed = header.size();
  std::set<std::string> columns;  // of the header
  std::vector<std::map<std::string, std::string>> rows(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].exit_code != 0) continue;  // what it has on disk may be of an earlier run
    for (const Stage& stage : stages()) {
      if (!is_asked(stage, only)) continue;
      const ordered_json record = record_of(cells[i].cell, stage);
      if (!record.is_object()) continue;
      for (const auto& [name, value] : record["figures"].items()) {
        const std::string column = stage.name + "." + name;
        if (columns.insert(column).second) header.push_back(column);
        rows[i][column] = text_of(value);
      }
    }
  }
  CsvText csv(header);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    csv.add(cells[i].cell.lexically_relative(folder).generic_string())
        .add(cells[i].exit_code)
        .add(cells[i].seconds)
        .add(cells[i].message)
        .add(cells[i].failed_stage);
    for (std::size_t k = n_fixed; k < header.size(); ++k) csv.add(rows[i][header[k]]);
    csv.end_row();
  }
  write_whole(file, csv.str());
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
  for (const auto& row : rows) {
    for (std::size_t k = 0; k + 1 < row.size(); ++k) widths[k] = std::max(widths[k], row[k].size());
  }
  std::ostringstream text;
  for (const auto& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k)
      text << (k == 0 ? "\n  " : "   ") << std::left << std::setw(static_cast<int>(widths[k])) << row[k];
  }
  return text.str();
}

}  // namespace mbtfm::runner
