#include "pipeline/runner/batch_table.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <map>
#include <set>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/json.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/record.h"

namespace mbtfm::runner {
namespace fs = std::filesystem;

namespace {

/// What a stage that has ended says of itself.
struct StageSays {
  std::string summary;
  std::vector<std::pair<std::string, std::string>> figures;  ///< name, value
  std::vector<Finding> findings;
};

std::string text_of(const Value& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using V = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<V, std::string>) return v;
        if constexpr (std::is_same_v<V, bool>) return v ? "true" : "false";
        if constexpr (std::is_same_v<V, double>) return shortest(v);
        if constexpr (std::is_same_v<V, std::int64_t>) return std::to_string(v);
      },
      value);
}

/// None where there is no record, or a damaged one: the run itself tells.
std::optional<StageSays> record_of(const fs::path& cell, const Stage& stage) {
  const fs::path file = record_file_of(cell, stage);
  if (!files::is_own_file(file)) return std::nullopt;
  try {
    const files::JsonRecord record(file, "a stage's record");
    StageSays says{.summary = record.text_or("summary", ""), .figures = {}, .findings = files::findings_of(record)};
    for (const auto& [name, value] : record.at("figures").members()) {
      // null: not a number, in JSON
      says.figures.emplace_back(name, value.json().is_null() ? std::string() : text_of(value.figure()));
    }
    return says;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

std::string last_summary(const fs::path& cell, const std::vector<std::string>& only) {
  std::string summary;
  for (const Stage& stage : stages()) {
    if (!is_asked(stage, only)) continue;
    const auto record = record_of(cell, stage);
    if (record && !record->summary.empty()) summary = record->summary;
  }
  return summary;
}

void write_batch_table(const fs::path& file, const fs::path& folder, const std::vector<BatchCell>& cells,
                       const std::vector<std::string>& only) {
  std::vector<std::string> header = {"cell", "exit_code", "seconds", "message", "failed_stage", "findings"};
  const std::size_t n_fixed = header.size();
  std::set<std::string> columns;  // of the header
  std::vector<std::map<std::string, std::string>> rows(cells.size());
  std::vector<std::vector<Finding>> findings(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].exit_code != 0) continue;  // what it has on disk may be of an earlier run
    for (const Stage& stage : stages()) {
      if (!is_asked(stage, only)) continue;
      const auto record = record_of(cells[i].cell, stage);
      if (!record) continue;
      findings[i].insert(findings[i].end(), record->findings.begin(), record->findings.end());
      for (const auto& [name, value] : record->figures) {
        const std::string column = stage.name + "." + name;
        if (columns.insert(column).second) header.push_back(column);
        rows[i][column] = value;
      }
    }
  }
  files::CsvText csv(header);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    csv.add(cells[i].cell.lexically_relative(folder).generic_string())
        .add(cells[i].exit_code)
        .add(cells[i].seconds)
        .add(cells[i].message)
        .add(cells[i].failed_stage)
        .add(open_ids(findings[i]));
    for (std::size_t k = n_fixed; k < header.size(); ++k) csv.add(rows[i][header[k]]);
    csv.end_row();
  }
  files::write_whole(file, csv.str());
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
