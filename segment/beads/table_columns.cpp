#include "segment/beads/table_columns.h"

#include <algorithm>
#include <map>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/files/names.h"

namespace mbtfm::beads {
namespace {

using files::CsvTable;
using files::ForeignTable;
using files::lower_case;

constexpr const char* kHowToWriteNumbers =
    "a number has one decimal mark, nothing between thousands, no unit beside it and is no date; leave the cell empty "

    "where there is none";

std::optional<double> length_named(const std::string& word) {
  static const std::map<std::string, double> lengths_um = {
      {"px", 0},          {"pix", 0},    {"pixel", 0},       {"pixels", 0},      {"um", 1},          {"\xC2\xB5m", 1},
      {"voxel", 0},       {"voxels", 0}, {"\xC3\xA5", 1e-4}, {"\xC3\x85", 1e-4}, {"angstrom", 1e-4}, {"\xCE\xBCm", 1},
      {"\xB5m", 1},       {"micron", 1}, {"microns", 1},     {"micrometer", 1},  {"micrometers", 1}, {"micrometre", 1},
      {"micrometres", 1}, {"nm", 1e-3},  {"mm", 1e3},        {"cm", 1e4},        {"m", 1e6}};
  const auto found = lengths_um.find(word);
  return found == lengths_um.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

std::optional<Unit> unit_named(std::string text) {
  text = lower_case(std::move(text));
  static const std::map<std::string, double> times_per_s = {
      {"s", 1},          {"sec", 1},         {"second", 1},       {"ms", 1e3}, {"min", 1.0 / 60}, {"minute", 1.0 / 60},
      {"h", 1.0 / 3600}, {"hr", 1.0 / 3600}, {"hour", 1.0 / 3600}};
  constexpr std::string_view kRaised = "\xE2\x81\xBB\xC2\xB9";
  if (const std::size_t raised = text.find(kRaised); raised != text.npos) text.replace(raised, kRaised.size(), "-1");
  if (const std::size_t blank = text.rfind(' '); text.ends_with("-1") && blank != text.npos) {  // "um s^-1"
    text[blank] = '/';
    text.resize(text.size() - 2);
  }
  std::erase_if(text, [](char c) { return c == ' ' || c == '"' || c == '^'; });
  const std::size_t slash = text.find('/');
  const std::optional<double> length = length_named(text.substr(0, slash));
  if (!length) return std::nullopt;
  Unit unit{.um = *length};
  if (slash == text.npos || text.substr(slash + 1) == "frame") return unit;
  const auto time = times_per_s.find(text.substr(slash + 1));
  if (time == times_per_s.end()) return std::nullopt;
  unit.per_s = time->second;
  return unit;
}

ColumnName parts_of(const std::string& name) {
  ColumnName parts;
  std::string said = name;
  if (const std::size_t open = name.find_first_of("[("); open != name.npos) {
    parts.unit = unit_named(name.substr(open + 1, name.find_first_of("])", open) - open - 1));
    said = name.substr(0, open);
  } else {
    // "x_px", "x in px", and what R makes of "x [px]" and "u [px/frame]": "x..px.", "u..px.frame."
    const std::string named = name.substr(0, name.find_last_not_of("._ ") + 1);
    std::size_t end = named.npos;
    for (int k = 0; k < 2 && !parts.unit && end != 0; ++k) {
      const std::size_t mark = named.find_last_of("_ .", end);
      if (mark == named.npos) break;
      std::string unit = named.substr(mark + 1);
      std::ranges::replace(unit, '.', '/');
      parts.unit = unit_named(unit);
      if (parts.unit) said = named.substr(0, mark);
      end = mark - 1;
    }
    if (parts.unit && said.ends_with(" in")) said.resize(said.size() - 3);
  }
  for (const char c : lower_case(said))
    if (std::isalnum(static_cast<unsigned char>(c))) parts.key += c;
  return parts;
}

namespace {

/// How programs call the components.
const std::array<std::set<std::string>, kComponents>& known_names() {
  static const std::array<std::set<std::string>, kComponents> names = {{
      {"x", "xpos", "posx", "xposition", "positionx", "xcoordinate", "xcoord"},
      {"y", "ypos", "posy", "yposition", "positiony", "ycoordinate", "ycoord"},
      {"u", "ux", "vx", "dx", "ux1", "xdisplacement", "displacementx", "dispx", "xdisp", "velocityu", "uvelocity",
       "velocityx", "xvelocity", "displacementu", "udisplacement"},
      {"v", "uy", "vy", "dy", "uy1", "ydisplacement", "displacementy", "dispy", "ydisp", "velocityv", "vvelocity",
       "velocityy", "yvelocity", "displacementv", "vdisplacement"},
  }};
  return names;
}

/// The same as rows and columns of a picture. Lattices number theirs, too: these count where there are no others.
constexpr std::array<std::array<std::string_view, 2>, kComponents> kOfPicture = {
    {{"col", "column"}, {"row", "line"}, {"dc", "dcol"}, {"dr", "drow"}}};

}  // namespace

const std::map<std::string, RowMark>& known_marks() {
  static const std::map<std::string, RowMark> marks = {
      {"mask", RowMark::zero_if_measured},    {"flags", RowMark::zero_if_measured},
      {"isnan", RowMark::zero_if_measured},   {"isvalid", RowMark::zero_if_masked},
      {"outlier", RowMark::zero_if_measured}, {"isoutlier", RowMark::zero_if_measured},
      {"masked", RowMark::zero_if_measured},  {"ismasked", RowMark::zero_if_measured},
      {"good", RowMark::zero_if_masked},      {"typevector", RowMark::one_if_measured},
      {"valid", RowMark::zero_if_masked},     {"vectortype", RowMark::one_if_measured},
      {"chc", RowMark::positive_if_measured}};
  return marks;
}

std::array<Asked, kComponents> asked_for(const TrackParameters& p) {
  static const TrackParameters own;
  return {{{p.x_column, own.x_column, "x_column"},
           {p.y_column, own.y_column, "y_column"},
           {p.ux_column, own.ux_column, "ux_column"},
           {p.uy_column, own.uy_column, "uy_column"}}};
}

std::string how_to_set(const std::string& parameter, const std::string& value) {
  return "track." + parameter + " = \"" + value + "\" in cell.toml, or --" + parameter + " '" + value + "'";
}

std::string without_marks(const std::string& name) {
  const std::size_t first = name.find_first_not_of("#% \t\""), last = name.find_last_not_of(" \t\"");
  return first == name.npos ? "" : name.substr(first, last - first + 1);
}

namespace {

/// Columns of a header that may be meant.
std::vector<std::size_t> matches_in(const Header& header, const Asked& asked, std::size_t component) {
  const auto all = [&](const auto& is_one) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < header.size(); ++i)
      if (is_one(header[i])) found.push_back(i);
    return found;
  };
  const std::string name = without_marks(asked.name);
  std::vector<std::size_t> found = all([&](const std::string& column) { return without_marks(column) == name; });
  if (!found.empty()) return found;
  if (asked.name == asked.own) {
    found = all([&](const std::string& column) { return known_names()[component].contains(parts_of(column).key); });
    if (!found.empty()) return found;
    const auto& words = kOfPicture[component];
    return all(
        [&](const std::string& column) { return std::ranges::find(words, parts_of(column).key) != words.end(); });
  }
  const std::size_t number = parsed<std::size_t>(name).value_or(0);
  return number >= 1 && number <= header.size() ? std::vector{number - 1} : std::vector<std::size_t>();
}

/// No names: none at all, or those that a program gives to columns without one.
bool is_without_names(const Header& header) {
  return std::ranges::all_of(header, [](const std::string& name) {
    const std::string key = lower_case(name);
    const std::size_t digits = key.starts_with("var") ? 3 : key.starts_with("column") ? 6 : 0;
    return key.find_first_not_of("0123456789", digits) == key.npos && (digits > 0 || key.size() < 3);
  });
}

std::optional<Found> found_in(const Header& header, const TrackParameters& parameters, const std::string& where) {
  Found found{.header = header, .units = std::vector<std::optional<Unit>>(header.size())};
  const auto asked = asked_for(parameters);
  for (std::size_t k = 0; k < kComponents; ++k) {
    const std::vector<std::size_t> matches = matches_in(header, asked[k], k);
    if (matches.empty()) return std::nullopt;
    if (matches.size() > 1) {
      throw InputError(where, "one column for " + std::string(asked[k].parameter),
                       std::to_string(matches.size()) + ": " + header[matches[0]] + ", " + header[matches[1]],
                       how_to_set(asked[k].parameter, std::to_string(matches[0] + 1)) + " for the first of them");
    }
    found.columns[k] = matches.front();
  }
  for (std::size_t i = 0; i < header.size(); ++i) found.units[i] = parts_of(header[i]).unit;
  return found;
}

[[noreturn]] void fail_to_find(const ForeignTable& table, const Header& header, int line,
                               const TrackParameters& parameters) {
  std::string missing, how;
  const auto asked = asked_for(parameters);
  for (std::size_t k = 0; k < kComponents; ++k) {
    if (!matches_in(header, asked[k], k).empty()) continue;
    missing += (missing.empty() ? "" : ", ") + asked[k].name;
    how += " --" + std::string(asked[k].parameter) + " " + std::to_string(k + 1);
  }
  const auto has = [&](std::initializer_list<const char*> words) {
    return std::ranges::any_of(header, [&](const std::string& name) {
      const std::string key = parts_of(name).key;
      return std::ranges::any_of(words, [&](const char* word) { return key.find(word) != key.npos; });
    });
  };
  const bool has_angle = has({"angle", "direction", "theta"}), has_tracks = has({"track"});
  if (has_tracks)
    throw InputError(table.name + ":" + std::to_string(line), "columns " + missing, "tracks: " + listed(header),
                     "make a row for each bead: its place in the relaxed picture, and as ux_um, uy_um how far it lies "
                     "from there in the stressed one");
  if (has_angle) how = "make two columns of length and angle: ux = length x cos(angle) and uy = length x sin(angle)";
  throw InputError(
      table.name + ":" + std::to_string(line), "columns " + missing,
      is_without_names(header) ? std::to_string(header.size()) + " columns without names"
                               : "the columns " + listed(header),
      has_angle ? how : "name them, or give their numbers, as in" + how + " (in cell.toml: track.x_column = \"1\")");
}

std::string text_of(const CsvTable::Row& row) {
  std::string text;
  for (const std::string& cell : row.fields) text += (text.empty() ? "" : " ") + cell;
  return text;
}

}  // namespace

std::string text_above(const ForeignTable& table) {
  std::string text;
  for (const std::string& line : table.lines_above) text += line + "\n";
  return text;
}

Header variables_of(const ForeignTable& table) {
  const std::string all = text_above(table), key = lower_case(all);
  const std::size_t word = key.find("variables");
  if (word == key.npos) return {};
  const std::size_t from = std::min(all.find('=', word), all.size() - 1) + 1;
  const std::string text = all.substr(from, std::min(key.find("zone", from), key.find("datasetauxdata", from)) - from);
  Header names;
  const bool has_quotes = text.find('"') != text.npos;
  for (std::size_t at = 0; at < text.size();) {
    const char* separators = has_quotes ? "\"" : ", \t\n";
    const std::size_t begin = text.find_first_not_of(has_quotes ? "\", \t\n" : ", \t\n", at);
    if (begin == text.npos) break;
    const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
    names.push_back(without_marks(text.substr(begin, end - begin)));
    at = end + 1;
  }
  return names;
}

namespace {

/// What lies beneath the names and is no row of numbers is units or longer names. @throws InputError where it has
/// numbers
void expect_no_numbers(const ForeignTable& table, int line_of_header) {
  const std::size_t n = table.rows.front().fields.size();
  for (const CsvTable::Row& row : table.above) {
    const auto n_numbers = static_cast<std::size_t>(std::ranges::count_if(
        row.fields, [](const std::string& cell) { return files::numeral_in(cell) != files::Numeral::none; }));
    const bool is_row = line_of_header > 0
                            ? row.line > line_of_header && n_numbers > 0
                            : row.fields.size() == n && 2 * n_numbers >= n && !is_without_names(row.fields);
    if (!is_row) continue;
    throw InputError(table.name + ":" + std::to_string(row.line), std::to_string(n) + " numbers or more, or units",
                     "'" + text_of(row) + "'", kHowToWriteNumbers);
  }
}

}  // namespace

Found header_of(ForeignTable& table, const TrackParameters& parameters) {
  const std::size_t n = table.rows.front().fields.size();
  const auto as_wide = [&](Header header) -> std::optional<Header> {
    while (header.size() > n && header.back().empty()) header.pop_back();
    const bool ends_empty = header.size() + 1 == n && std::ranges::all_of(table.rows, [](const CsvTable::Row& row) {
                              return row.fields.back().empty();
                            });
    if (ends_empty) header.emplace_back();
    // R and Python write the numbers of the rows in a column without a name
    const std::string& number = table.rows.front().fields.front();
    if (header.size() + 1 == n && (number == "0" || number == "1") &&
        table.rows.back().fields.front() == std::to_string(table.rows.size() - (number == "0" ? 1 : 0)))
      header.insert(header.begin(), "");
    return header.size() == n ? std::optional(std::move(header)) : std::nullopt;
  };
  std::vector<std::pair<Header, int>> candidates;
  for (const CsvTable::Row& row : table.above)
    if (auto header = as_wide(row.fields)) candidates.emplace_back(std::move(*header), row.line);
  if (auto header = as_wide(variables_of(table))) candidates.emplace_back(std::move(*header), table.above.back().line);
  for (std::size_t c = candidates.size(); c-- > 0;) {
    const auto& [header, line] = candidates[c];
    auto found = found_in(header, parameters, table.name + ":" + std::to_string(line));
    if (!found) continue;
    expect_no_numbers(table, line);
    for (std::size_t under = c + 1; under < candidates.size(); ++under)
      for (std::size_t i = 0; i < n; ++i)
        if (const auto unit = parts_of("_" + candidates[under].first[i]).unit; unit && !found->units[i])
          found->units[i] = unit;
    return *found;
  }
  const bool has_names = !candidates.empty() && !is_without_names(candidates.front().first);
  Header numbers(n);
  for (std::size_t i = 0; i < n; ++i) numbers[i] = std::to_string(i + 1);
  const int line = table.rows.front().line;
  if (has_names) fail_to_find(table, candidates.front().first, candidates.front().second, parameters);
  if (!table.above.empty() && candidates.empty() && !is_without_names(table.above.back().fields) &&
      table.above.back().fields.size() > 2) {
    const CsvTable::Row& last = table.above.back();
    if (auto found = found_in(last.fields, parameters, table.name))
      throw InputError(table.name + ":" + std::to_string(line),
                       std::to_string(last.fields.size()) + " fields, as in the header", std::to_string(n),
                       "is a separator or a decimal comma in a field? Save with semicolons between columns");
  }
  // the first four, where there are no others: x, y and the displacement
  TrackParameters by_number = parameters;
  std::string* names[] = {&by_number.x_column, &by_number.y_column, &by_number.ux_column, &by_number.uy_column};
  const auto asked = asked_for(parameters);
  const bool is_asked = std::ranges::any_of(asked, [](const Asked& a) { return a.name != a.own; });
  constexpr std::array kBeginSo = {TableForm::imagej_piv, TableForm::pivlab, TableForm::openpiv, TableForm::davis};
  if (!is_asked && (n == kComponents || std::ranges::find(kBeginSo, parameters.table) != kBeginSo.end()))
    for (std::size_t k = 0; k < kComponents; ++k) *names[k] = std::to_string(k + 1);
  expect_no_numbers(table, 0);
  auto found = found_in(numbers, by_number, table.name + ":" + std::to_string(line));
  if (!found) fail_to_find(table, numbers, line, by_number);
  return *found;
}

void take_numbered_header(ForeignTable& table) {
  if (!table.above.empty() || table.rows.size() < 2) return;
  const std::vector<std::string>& fields = table.rows.front().fields;
  const std::size_t empty = fields.front().empty() ? 1 : 0, first = fields[empty] == "1" ? 1 : 0;
  for (std::size_t i = empty; i < fields.size(); ++i)
    if (fields[i] != std::to_string(i - empty + first)) return;
  table.above.push_back(std::move(table.rows.front()));
  table.rows.erase(table.rows.begin());
}

}  // namespace mbtfm::beads
