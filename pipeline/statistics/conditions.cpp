/// What a user says of the cells of a study: their condition, and which must not enter.
#include <algorithm>
#include <map>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/files/foreign_table.h"
#include "pipeline/files/names.h"
#include "pipeline/files/table_text.h"
#include "pipeline/report/texts.h"
#include "pipeline/statistics/review.h"

namespace mbtfm::statistics {
namespace {

/// 1 for "folder", 2 for "folder2", …; 0 for a column.
int folder_level(const std::string& condition_from) {
  if (!condition_from.starts_with("folder")) return 0;
  const std::string level = condition_from.substr(6);
  if (level.empty()) return 1;
  return level.size() == 1 && level[0] >= '1' && level[0] <= '9' ? level[0] - '0' : 0;
}

std::string folder_of(const std::string& name, int level) {
  const Path path(name);
  if (std::distance(path.begin(), path.end()) <= level) {
    throw InputError(name, "a folder of its condition above the cell, at level " + std::to_string(level),
                     "the cell itself", "sort the cells into a folder for each condition, or name them in --table");
  }
  return std::next(path.begin(), level - 1)->string();
}

/// Where a word about each cell comes from: a folder above it, a column of the table, or nowhere.
struct Source {
  int level = 0;            ///< of the folder; 0: none
  std::string column = {};  ///< empty: none
};

/// The column of a form that nobody filled in asks for nothing.
bool says_anything(const files::CsvTable& table, const std::string& column) {
  for (int row = 0; row < table.n_rows(); ++row)
    if (!table.text(row, column).empty()) return true;
  return false;
}

/// @param usual  columns that count without being asked for
Source source_of(const std::string& asked, const char* flag, const std::vector<std::string>& usual,
                 const std::optional<files::CsvTable>& table) {
  if (const int level = folder_level(asked); level > 0) return {.level = level};
  if (!asked.empty()) {
    if (!table)
      throw UsageError("--" + std::string(flag) + " " + asked +
                       ": expected `folder`, or a column of a table given by --table");
    table->require({asked});
    return {.column = asked};
  }
  for (const std::string& column : usual)
    if (table && table->has(column) && says_anything(*table, column)) return {.column = column};
  return {};
}

/// What a form says where nobody is to be left out.
std::string reason_in(const std::string& exclude) {
  const std::string word = files::lower_case(exclude);
  if (word.starts_with('?')) return exclude;  // a doubt
  for (const char* nobody : {"no", "n", "0", "false", "f", "none", "nein", "non", "nej", "nee"})
    if (word == nobody) return {};
  return files::is_missing(exclude) ? "" : exclude;
}

/// Of a condition "none" may be one, and what a spreadsheet could not compute is not ("#REF!").
bool is_no_name(const std::string& word) {
  static const std::vector<std::string> kNoName = {"na", "n/a", "nan"};
  return std::ranges::find(kNoName, files::lower_case(word)) != kNoName.end() ||
         (word.starts_with('#') && files::is_missing(word));
}

const std::vector<std::string> kExclude = {"exclude", "excluded"}, kInclude = {"include", "included"};

/// The first of several names that a form has for one column; empty: none.
std::string column_of(const files::CsvTable& table, const std::vector<std::string>& names) {
  const auto found = std::ranges::find_if(names, [&](const std::string& name) { return table.has(name); });
  return found == names.end() ? "" : *found;
}

/// Names that differ in capitals alone become the first of them.
void join_capitals(std::vector<CellNote>& notes, std::string CellNote::*member, const char* noun,
                   std::vector<std::string>& warnings) {
  std::map<std::string, std::string> first;
  std::map<std::string, std::set<std::string>> others;
  for (CellNote& note : notes) {
    const std::string& spelled = first.emplace(files::folded(note.*member), note.*member).first->second;
    if (note.*member == spelled) continue;
    others[spelled].insert(note.*member);
    note.*member = spelled;
  }
  for (const auto& [spelled, same] : others) {
    warnings.push_back("The " + std::string(noun) + " " + spelled + " and " + listed(same) +
                       " are taken for one: they differ in capitals alone.");
  }
}

bool is_called(const std::string& name, const std::string& word) {
  return files::folded(word) == files::folded(name) ||
         files::folded(word) == files::folded(Path(name).filename().string());
}

/// Of a cell that is not in the study.
std::string advice_on_unknown(const std::vector<std::string>& names, const files::CsvTable& table,
                              const std::string& asked) {
  for (const Path& path : {Path(asked), Path(asked).parent_path()})  // a folder of another disk, a picture in the cell
    for (const std::string& name : names)
      if (path == name || path.generic_string().ends_with("/" + name))
        return "names are relative to the folder of the study: write '" + name + "'";
  std::string without_row;
  for (const std::string& name : names) {
    bool is_there = false;
    for (int row = 0; row < table.n_rows() && !is_there; ++row) is_there = is_called(name, table.text(row, "cell"));
    if (is_there) continue;
    without_row = "; " + name +
                  " has no row yet: spreadsheets turn such names into dates or numbers, unless the column "
                  "is formatted as text";
    break;
  }
  return "names are relative to the folder of the study, as in " + names.front() + without_row +
         "; take out a row that is no cell";
}

}  // namespace

std::size_t index_of_cell(const std::vector<std::string>& names, const files::CsvTable& table, int row) {
  std::string asked = table.text(row, "cell");
  std::ranges::replace(asked, '\\', '/');
  asked = Path(asked).lexically_normal().generic_string();  // "./cell_1/"
  if (asked.ends_with('/')) asked.pop_back();
  const auto exact = std::find(names.begin(), names.end(), asked);
  if (exact != names.end()) return static_cast<std::size_t>(exact - names.begin());
  const auto those = [&](const auto& is_meant) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < names.size(); ++i)
      if (is_meant(names[i])) found.push_back(i);
    return found;
  };
  std::vector<std::size_t> matches = those([&](const std::string& name) { return Path(name).filename() == asked; });
  if (matches.empty()) matches = those([&](const std::string& name) { return is_called(name, asked); });
  if (matches.size() == 1) return matches.front();
  table.fail(row, "cell", "a cell folder of the study",
             matches.empty() ? advice_on_unknown(names, table, asked)
                             : "several cells are called so: give the folders above it, too");
}

CellNotes notes_of(const std::vector<std::string>& names, const std::string& condition_from,
                   const std::string& replicate_from, const std::optional<Path>& table) {
  std::optional<files::CsvTable> rows;
  if (table) {
    rows = files::read_records(
        files::read_table_text(*table), table->string(), "cell",
        {"cell", "exclude", "excluded", "include", "included", "condition", "group", "treatment", "replicate", "day"});
  }
  const Source condition = source_of(condition_from, "condition-from", {"condition", "group", "treatment"}, rows);
  const Source replicate = source_of(replicate_from, "replicate-from", {"replicate", "day"}, rows);
  CellNotes result{.of_cells = std::vector<CellNote>(names.size())};
  std::vector<CellNote>& notes = result.of_cells;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (condition.level > 0) notes[i].condition = folder_of(names[i], condition.level);
    if (replicate.level > 0) notes[i].replicate = folder_of(names[i], replicate.level);
  }
  if (!rows) return result;
  const std::string exclude = column_of(*rows, kExclude), include = column_of(*rows, kInclude);
  if (condition.level == 0 && condition.column.empty() && exclude.empty() && include.empty())
    result.warnings.push_back(report::sentence("study.warn-no-condition"));
  std::vector<bool> is_named(names.size(), false);
  for (int row = 0; row < rows->n_rows(); ++row) {
    const std::size_t i = index_of_cell(names, *rows, row);
    if (is_named[i]) rows->fail(row, "cell", "each cell once", "take one of its rows out");
    is_named[i] = true;
    if (!exclude.empty()) notes[i].reason_to_exclude = reason_in(rows->text(row, exclude));
    if (!include.empty() && !rows->text(row, include).empty() && reason_in(rows->text(row, include)).empty())
      notes[i].reason_to_exclude = include + ": " + rows->text(row, include);
    const auto take = [&](const std::string& column, std::string CellNote::*member) {
      if (column.empty()) return;
      notes[i].*member = rows->text(row, column);
      if (is_no_name(notes[i].*member)) (notes[i].*member).clear();
      if ((notes[i].*member).empty() && notes[i].reason_to_exclude.empty())
        notes[i].reason_to_exclude = "no " + column + " in the table (of merged cells, the first alone has it)";
    };
    take(condition.column, &CellNote::condition);
    take(replicate.column, &CellNote::replicate);
  }
  for (std::size_t i = 0; i < names.size(); ++i)
    if (!is_named[i]) notes[i].reason_to_exclude = "not in the table";
  join_capitals(notes, &CellNote::condition, "conditions", result.warnings);
  join_capitals(notes, &CellNote::replicate, "replicates", result.warnings);
  return result;
}

}  // namespace mbtfm::statistics
