#include "segment/beads/given_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/foreign_table.h"
#include "pipeline/files/names.h"
#include "pipeline/files/table_text.h"
#include "pipeline/files/text.h"

namespace mbtfm::beads {
namespace {

using files::CsvTable;
using files::ForeignTable;
using files::lower_case;

constexpr const char* kHowToWriteNumbers =
    "a number has one decimal mark, nothing between thousands, no unit beside it and is no date; leave the cell empty "
    "where there is none";

constexpr std::size_t kComponents = 4;  // x, y and the displacement along them

/// Names as people say them, in the order of TableForm.
constexpr std::array kPrograms = {"",      "",        "OpenPIV",   "PIVlab", "the PIV plugin of ImageJ",
                                  "DaVis", "Tecplot", "TrackMate", "pyTFM"};

/// How long and how soon: "px/frame", "mm", "m/s".
struct Unit {
  double um = 0;     ///< 0: a pixel
  double per_s = 0;  ///< 0: a displacement; else a velocity
  bool operator==(const Unit&) const = default;
};

std::optional<double> length_named(const std::string& word) {
  static const std::map<std::string, double> lengths_um = {
      {"px", 0},          {"pix", 0},    {"pixel", 0},       {"pixels", 0},      {"um", 1},          {"\xC2\xB5m", 1},
      {"voxel", 0},       {"voxels", 0}, {"\xC3\xA5", 1e-4}, {"\xC3\x85", 1e-4}, {"angstrom", 1e-4}, {"\xCE\xBCm", 1},
      {"\xB5m", 1},       {"micron", 1}, {"microns", 1},     {"micrometer", 1},  {"micrometers", 1}, {"micrometre", 1},
      {"micrometres", 1}, {"nm", 1e-3},  {"mm", 1e3},        {"cm", 1e4},        {"m", 1e6}};
  const auto found = lengths_um.find(word);
  return found == lengths_um.end() ? std::nullopt : std::optional(found->second);
}

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

/// "Velocity u [m/s]": velocityu and m/s. "x_px": x and px.
struct ColumnName {
  std::string key;
  std::optional<Unit> unit;
};

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

/// What a parameter asks for, what it is by default, and which parameter that is.
struct Asked {
  const std::string& name;
  const std::string& own;
  const char* parameter;
};

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

using Header = std::vector<std::string>;

std::string without_marks(const std::string& name) {
  const std::size_t first = name.find_first_not_of("#% \t\""), last = name.find_last_not_of(" \t\"");
  return first == name.npos ? "" : name.substr(first, last - first + 1);
}

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
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error == std::errc() && end == name.data() + name.size() && number >= 1 && number <= header.size())
    return {number - 1};
  return {};
}

struct Found {
  Header header;  ///< of the row that names the columns; their numbers if none does
  std::array<std::size_t, kComponents> columns{};
  std::vector<std::optional<Unit>> units;  ///< of each column, from its name or a row beneath
};

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
  const bool has_angle = std::ranges::any_of(
      header, [](const std::string& name) { return parts_of(name).key.find("angle") != std::string::npos; });
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

std::string text_above(const ForeignTable& table) {
  std::string text;
  for (const std::string& line : table.lines_above) text += line + "\n";
  return text;
}

/// The names in quotes or between commas after `VARIABLES =`, over as many lines as they take.
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

/// The row that names the columns: the lowest above the numbers in which all that are needed are found.
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

/// Columns that a program numbers from 0 or 1 in the first row, as data without a header.
void take_numbered_header(ForeignTable& table) {
  if (!table.above.empty() || table.rows.size() < 2) return;
  const std::vector<std::string>& fields = table.rows.front().fields;
  const std::size_t empty = fields.front().empty() ? 1 : 0, first = fields[empty] == "1" ? 1 : 0;
  for (std::size_t i = empty; i < fields.size(); ++i)
    if (fields[i] != std::to_string(i - empty + first)) return;
  table.above.push_back(std::move(table.rows.front()));
  table.rows.erase(table.rows.begin());
}

bool has_columns(const ForeignTable& table, const std::set<std::string>& keys) {
  return std::ranges::any_of(table.above, [&](const CsvTable::Row& row) {
    std::set<std::string> found;
    for (const std::string& name : row.fields) found.insert(parts_of(without_marks(name)).key);
    return std::ranges::includes(found, keys);
  });
}

bool has_names_of_ours(const ForeignTable& table, const TrackParameters& p) {
  return std::ranges::any_of(table.above, [&](const CsvTable::Row& row) {
    return std::ranges::all_of(asked_for(p), [&](const Asked& asked) {
      return asked.name == asked.own && std::ranges::find(row.fields, asked.own) != row.fields.end();
    });
  });
}

/// By the head of the file.
TableForm form_of(const ForeignTable& table, const TrackParameters& parameters) {
  if (parameters.table != TableForm::automatic) return parameters.table;
  const std::string text = text_above(table);
  if (lower_case(text).find("=block") != text.npos)
    throw InputError(table.name, "a row for each vector", "blocks of one variable each",
                     "export it as points (F=POINT)");
  if (has_names_of_ours(table, parameters)) return TableForm::plain;
  if (text.find("DaVis") != text.npos) return TableForm::davis;
  if (!variables_of(table).empty()) return TableForm::tecplot;
  if (text.find("PIVlab") != text.npos || text.find("conversion factor xy") != text.npos ||
      has_columns(table, {"vectortype"}))
    return TableForm::pivlab;
  if (has_columns(table, {"ux1", "uy1", "mag1"})) return TableForm::imagej_piv;
  if (has_columns(table, {"label", "trackid"})) return TableForm::trackmate;
  if (has_columns(table, {"x", "y", "u", "v", "mask"}) || has_columns(table, {"x", "y", "u", "v", "flags"}))
    return TableForm::openpiv;
  constexpr std::array kWidthsOfImagej = {4, 5, 16};
  const auto n = static_cast<int>(table.rows.front().fields.size());
  if (table.above.empty() && table.separator == ' ' && std::ranges::find(kWidthsOfImagej, n) != kWidthsOfImagej.end() &&
      std::ranges::all_of(table.rows, [](const CsvTable::Row& row) {
        return files::numeral_in(row.fields[0]) == files::Numeral::whole &&
               files::numeral_in(row.fields[1]) == files::Numeral::whole;
      }))
    return TableForm::imagej_piv;
  return TableForm::plain;
}

/// "conversion factor xy (px -> m): 2e-07": metres by pixel, and m/s by pixel a frame.
struct PivlabFactors {
  double m_per_px = 1, m_per_s_per_px = 1;
  bool are_there = false;
};

std::optional<double> number_after(const std::string& text, const std::string& words) {
  const std::size_t found = text.find(words);
  if (found == text.npos) return std::nullopt;
  const std::size_t begin = text.find_first_not_of(": ", found + words.size());
  double value = 0;
  if (begin == text.npos || std::from_chars(text.data() + begin, text.data() + text.size(), value).ec != std::errc())
    return std::nullopt;
  return value;
}

PivlabFactors factors_of(const ForeignTable& table) {
  const std::string text = text_above(table);
  const auto xy = number_after(text, "(px -> m)"), uv = number_after(text, "(px/frame -> m/s)");
  if (!xy || !uv) return {};
  if (!(*xy > 0) || !(*uv > 0)) {
    throw InputError(table.name, "conversion factors > 0 in the lines above the header",
                     shortest(*xy) + " and " + shortest(*uv),
                     "let x point right in PIVlab's calibration, and export it again");
  }
  return {.m_per_px = *xy, .m_per_s_per_px = *uv, .are_there = true};
}

/// The units in DaVis's first line, place first: ... "position" "mm" "position" "mm" "velocity" "m/s".
std::vector<Unit> units_of_davis(const ForeignTable& table) {
  std::vector<Unit> units;
  for (const std::string& text : table.lines_above) {
    if (text.find("DaVis") == text.npos) continue;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find(' ', at), text.size());
      if (const auto unit = unit_named(text.substr(at, end - at))) units.push_back(*unit);
      at = end + 1;
    }
  }
  return units;
}

double pixel_um(const TrackParameters& parameters) {
  if (parameters.pixel_size_um) return *parameters.pixel_size_um;
  throw UsageError("lengths in px need pixel_size_um: give it in cell.toml or as --pixel_size_um");
}

/// A length of a column's unit. @throws InputError where nobody states it; UsageError where the pixel's size lacks
double um_of(const std::string& file, const std::string& column, const std::optional<Unit>& unit,
             const TrackParameters& parameters) {
  if (unit) return unit->um > 0 ? unit->um : pixel_um(parameters);
  throw InputError(file, "a unit of the column '" + column + "'",
                   column.find_first_of("[(") == column.npos ? "none in its name" : "one that is not known",
                   how_to_set("length_unit", "px") +
                       " if it is in pixels; um, mm or m are the others; convert the column if it is in none of them");
}

/// Seconds by which the column's numbers are multiplied; 1 for displacements.
double seconds_of(const std::string& file, const std::string& column, const std::optional<Unit>& stated,
                  const std::optional<double>& seconds) {
  const bool is_velocity = stated && stated->per_s > 0;
  if (stated && !is_velocity && seconds)
    throw InputError(file, "a velocity in the column '" + column + "'", "a displacement",
                     "leave track.seconds_between out");
  if (!is_velocity) return seconds.value_or(1);
  if (seconds) return stated->per_s * *seconds;
  throw InputError(file, "a displacement in the column '" + column + "'", "a velocity",
                   "set the time (s) between the images as in that program: track.seconds_between = 1 in cell.toml, or "
                   "--seconds_between 1");
}

/// The units of places and displacements: of the header, else of the parameter, else of the program.
void take_units(GivenTable& given, const std::string& file, const Found& found, const TrackParameters& parameters) {
  const auto& [x, y, ux, uy] = found.columns;
  const std::optional<Unit>&of_places = found.units[x], &of_displacements = found.units[ux];
  if (found.units[y] != of_places || found.units[uy] != of_displacements)
    throw InputError(file, "one unit along x and y", listed(found.header));
  std::optional<Unit> otherwise;
  if (parameters.length_unit != LengthUnit::automatic) otherwise = unit_named(name_of(parameters.length_unit));
  if (otherwise && of_places && of_displacements &&
      (of_places->um != otherwise->um || of_displacements->um != otherwise->um)) {
    throw InputError(
        file, "lengths in " + std::string(name_of(parameters.length_unit)) + ", as track.length_unit has it",
        "the columns " + given.x + " and " + given.ux, "leave track.length_unit out: the table states its units");
  }
  const bool is_of_pixels = given.form == TableForm::openpiv || given.form == TableForm::imagej_piv ||
                            given.form == TableForm::pivlab || given.form == TableForm::pytfm;
  if (!otherwise && is_of_pixels) otherwise = Unit{};
  const std::optional<Unit> place = of_places ? of_places : otherwise;
  given.place_um = um_of(file, given.x, place, parameters);
  given.displacement_um = um_of(file, given.ux, of_displacements ? of_displacements : otherwise, parameters) *
                          seconds_of(file, given.ux, of_displacements, parameters.seconds_between);
  // a place is the centre of a pixel: PIVlab counts them from 1, others from 0
  if (place->um == 0)
    given.first = given.form == TableForm::pivlab ? -0.5 : 0.5;
  else if (given.form == TableForm::trackmate)
    given.first = 0.5 * parameters.pixel_size_um.value_or(0) / given.place_um;
}

/// Of a field that PIVlab calibrated, as the factors above the header have it.
void take_factors(GivenTable& given, const std::string& file, const PivlabFactors& factors,
                  const TrackParameters& parameters) {
  constexpr double kSame = 0.01;
  const double own_um = 1e6 * factors.m_per_px;
  if (std::abs(parameters.pixel_size_um.value_or(own_um) / own_um - 1) > kSame) {
    throw InputError(file, "the pixel size that is set, " + shortest(*parameters.pixel_size_um) + " um",
                     shortest(own_um) + " um in the line above the header",
                     "set pixel_size_um = " + shortest(own_um) + ", or calibrate PIVlab's field again");
  }
  given.place_um = 1e6;
  given.displacement_um = own_um / factors.m_per_s_per_px;
  given.first = -0.5 * factors.m_per_px;
}

/// Places and displacements of spots in two frames, as a table of vectors.
void make_vectors_of_spots(ForeignTable& table, const TrackParameters& parameters, int& n_left_out) {
  const std::optional<int> relaxed = parameters.relaxed_plane.time, stressed = parameters.stressed_plane.time;
  const auto header = std::ranges::find_if(table.above, [](const CsvTable::Row& row) { return row.fields.size() > 3; });
  const auto column = [&](const char* key) {
    if (header != table.above.end())
      for (std::size_t i = 0; i < header->fields.size(); ++i)
        if (parts_of(header->fields[i]).key == key) return i;
    throw InputError(table.name, "columns TRACK_ID, FRAME, POSITION_X and POSITION_Y", "others",
                     "export the spots of the tracks (in TrackMate: Spots, then Export to CSV)");
  };
  const std::size_t track = column("trackid"), frame = column("frame"), x = column("positionx"),
                    y = column("positiony");
  std::optional<Unit> unit;
  for (const CsvTable::Row& row : table.above)
    if (x < row.fields.size() && !unit) unit = parts_of("_" + row.fields[x]).unit;
  if (!relaxed || !stressed) {
    throw InputError(table.name, "which frames of the tracks are meant", "no word of it",
                     "track.relaxed_time = 1 and track.stressed_time = 2 in cell.toml, or --relaxed_time 1 "
                     "--stressed_time 2 (TrackMate's FRAME 0 is 1)");
  }
  const std::string name = table.name;
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < table.rows.front().fields.size(); ++i) numbers.push_back(std::to_string(i + 1));
  const CsvTable spots(numbers, table.rows, name);
  const auto named = [](std::size_t i) { return std::to_string(i + 1); };  // which this row may lack
  struct Track {
    int line = 0;
    std::vector<Vec2> relaxed, stressed;
  };
  std::map<std::string, Track> tracks;
  for (int row = 0; row < spots.n_rows(); ++row) {
    const std::string id = spots.text(row, named(track));
    if (files::is_missing(id)) continue;
    const double at = spots.number(row, named(frame), Range::not_negative()) + 1;
    if (at != *relaxed && at != *stressed) continue;
    Track& found = tracks[id];
    found.line = table.rows[static_cast<std::size_t>(row)].line;
    (at == *relaxed ? found.relaxed : found.stressed)
        .push_back({spots.number(row, named(x)), spots.number(row, named(y))});
  }
  table.rows.clear();
  const double scale = unit && unit->um > 0 ? unit->um : 1;  // to um
  for (const auto& [id, t] : tracks) {
    if (t.relaxed.size() != 1 || t.stressed.size() != 1) {
      ++n_left_out;
      continue;
    }
    const Vec2 place = scale * t.relaxed.front(), u = scale * t.stressed.front() - place;
    table.rows.push_back({t.line, {shortest(place.x), shortest(place.y), shortest(u.x), shortest(u.y)}});
  }
  if (table.rows.empty()) {
    throw InputError(
        name,
        "tracks with a spot in frame " + std::to_string(*relaxed) + " and one in frame " + std::to_string(*stressed),
        "none", "track.relaxed_time and track.stressed_time count the frames from 1");
  }
  const std::string in = !unit ? "" : unit->um == 0 ? " [px]" : " [um]";
  table.above = {{1, {"x" + in, "y" + in, "u" + in, "v" + in}}};
}

/// A two-dimensional array as numpy.save writes it.
struct Array {
  std::size_t n_rows = 0, n_columns = 0;
  std::vector<double> values;
};

Array array_of(const std::filesystem::path& file) {
  const std::string bytes = files::read_text(file);
  const auto fail = [&](const std::string& found) {
    throw InputError(file.string(), "an array of rows and columns as numpy.save writes it", found);
  };
  constexpr std::size_t kHeader = 10;
  if (bytes.size() < kHeader || !bytes.starts_with("\x93NUMPY\x01")) fail("other bytes");
  const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i])); };
  const std::size_t n_header = byte(8) + 256 * byte(9), begin = kHeader + n_header;
  const std::string header = bytes.substr(kHeader, n_header);
  const bool is_double = header.find("'<f8'") != header.npos, is_single = header.find("'<f4'") != header.npos;
  if (!(is_double || is_single)) fail("numbers of another type");
  if (header.find("'fortran_order': False") == header.npos) fail("columns in the place of rows");
  Array array;
  const std::size_t open = header.find('(');
  int read = 0;
  if (open == header.npos || begin > bytes.size() ||
      std::sscanf(header.c_str() + open, "(%zu, %zu)%n", &array.n_rows, &array.n_columns, &read) != 2 || read == 0)
    fail("another shape");
  const std::size_t size = is_double ? sizeof(double) : sizeof(float), n_bytes = bytes.size() - begin;
  if (array.n_rows == 0 || array.n_columns == 0 || array.n_rows > n_bytes || array.n_columns > n_bytes ||
      array.n_rows * array.n_columns * size != n_bytes)
    fail(std::to_string(n_bytes) + " bytes of numbers");
  array.values.resize(array.n_rows * array.n_columns);
  for (std::size_t i = 0; i < array.values.size(); ++i) {
    float single = 0;
    if (is_double)
      std::memcpy(&array.values[i], bytes.data() + begin + i * size, size);
    else
      std::memcpy(&single, bytes.data() + begin + i * size, size), array.values[i] = static_cast<double>(single);
  }
  return array;
}

/// pyTFM's u.npy and v.npy: a lattice over the whole picture, first row on top, in px.
ForeignTable read_pytfm(const std::filesystem::path& file, const std::optional<images::ImageField>& picture) {
  std::string name = file.filename().string();
  const std::size_t letter = name.rfind("u.npy");
  if (letter == name.npos || letter + 5 != name.size())
    throw InputError(file.string(), "a file whose name ends on u.npy", name,
                     "name pyTFM's u; its v is read from beside it");
  name[letter] = 'v';
  const Array u = array_of(file), v = array_of(file.parent_path() / name);
  if (u.n_rows != v.n_rows || u.n_columns != v.n_columns)
    throw InputError(file.string(), "as many rows and columns as in " + name, "others");
  if (!picture) {
    throw InputError(file.string(), "the picture whose field it is", "none, and pyTFM does not state its spacing",
                     "mbtfm run takes it from the cell's images; for mbtfm-track give one of them as --cell_image");
  }
  const double step = static_cast<double>(picture->width) / static_cast<double>(u.n_columns);
  ForeignTable table{
      .name = file.string(), .above = {{1, {"x [px]", "y [px]", "u [px]", "v [px]"}}}, .lines_above = {}, .rows = {}};
  for (std::size_t j = 0; j < u.n_rows; ++j)
    for (std::size_t i = 0; i < u.n_columns; ++i) {
      const std::size_t k = j * u.n_columns + i;
      const auto at = [&](std::size_t n) { return shortest(step * (static_cast<double>(n) + 0.5) - 0.5); };
      table.rows.push_back({1, {at(i), at(j), shortest(u.values[k]), shortest(v.values[k])}});
    }
  return table;
}

/// "Mean" and "SD" beneath a column of numbers, as ImageJ has them: no vectors. @throws InputError
void expect_no_summary(const ForeignTable& table, std::size_t n_columns_before) {
  for (std::size_t i = 0; i < n_columns_before; ++i) {
    const bool is_numbered = files::numeral_in(table.rows.front().fields[i]) == files::Numeral::whole;
    const std::string& last = table.rows.back().fields[i];
    if (is_numbered && files::numeral_in(last) == files::Numeral::none && !files::is_missing(last))
      throw InputError(table.name + ":" + std::to_string(table.rows.back().line), "a vector",
                       "'" + last + "' in the place of its number", "take the rows out that sum up the others");
  }
}

/// In which order the rows of a lattice have their y.
enum class Order { none, rising, falling };

/// Of single beads, none: any of them may come first.
Order order_of(const std::vector<CsvTable::Row>& rows, std::size_t column) {
  std::set<std::string> all;
  double before = 0;
  Order order = Order::none;
  for (const CsvTable::Row& row : rows) {
    const std::string& cell = row.fields[column];
    double y = 0;
    if (std::from_chars(cell.data(), cell.data() + cell.size(), y).ec != std::errc()) continue;
    if (!all.empty() && order == Order::none && y != before) order = y < before ? Order::falling : Order::rising;
    before = y;
    all.insert(cell);
    if (2 * all.size() > rows.size()) return Order::none;
  }
  return order;
}

}  // namespace

std::string flag_of(RowMark mark, const std::string& cell) {
  constexpr const char* kMasked = "masked";
  constexpr const char* kFilled = "filled in";
  const std::string word = lower_case(cell);
  double code = word == "true" || word == "yes" || word == "ok" || word == "good" || word == "valid" ? 1 : 0;
  if (files::numeral_in(cell) != files::Numeral::none) std::from_chars(cell.data(), cell.data() + cell.size(), code);
  switch (mark) {
    case RowMark::zero_if_measured:
      return code == 0 ? "" : kMasked;
    case RowMark::zero_if_masked:
      return code == 0 ? kMasked : "";
    case RowMark::one_if_measured:
      return code == 1 ? "" : code == 0 ? kMasked : kFilled;
    case RowMark::positive_if_measured:
      return code > 0 ? "" : kMasked;
    case RowMark::code_of_imagej:
      return code == 999 ? kFilled : code == -1 ? kMasked : "";
  }
  return "";
}

GivenTable read_given_table(const std::filesystem::path& file, const TrackParameters& parameters,
                            const std::optional<images::ImageField>& picture) {
  const bool is_numpy = parameters.table == TableForm::pytfm || file.extension() == ".npy";
  const std::string name = file.string();
  ForeignTable table =
      is_numpy ? read_pytfm(file, picture) : files::read_numbers(files::read_table_text(file), name, kComponents);
  take_numbered_header(table);
  const TableForm form = is_numpy ? TableForm::pytfm : form_of(table, parameters);
  int n_left_out = 0;
  if (form == TableForm::trackmate) make_vectors_of_spots(table, parameters, n_left_out);
  const PivlabFactors factors = factors_of(table);
  const std::vector<Unit> davis = form == TableForm::davis ? units_of_davis(table) : std::vector<Unit>();
  const bool is_ours = has_names_of_ours(table, parameters);
  TrackParameters known = parameters;
  known.table = form;
  Found found = header_of(table, known);
  const auto& [x, y, ux, uy] = found.columns;
  // each name once: what has none, or another's, is called by its number
  Header names = found.header;
  std::set<std::string> taken;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i].empty() || !taken.insert(names[i]).second) names[i] = "no. " + std::to_string(i + 1);
  if (form == TableForm::davis && davis.size() >= 3) {
    for (const std::size_t i : {x, y})
      if (!found.units[i]) found.units[i] = davis[0];
    for (const std::size_t i : {ux, uy})
      if (!found.units[i]) found.units[i] = davis[2];
  }
  GivenTable given{
      .form = form, .rows = CsvTable(names, {}, name), .x = names[x], .y = names[y], .ux = names[ux], .uy = names[uy]};
  given.n_left_out = n_left_out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (without_marks(names[i]) == parameters.sigma_column) given.sigma = names[i];
    const auto mark = known_marks().find(parts_of(without_marks(names[i])).key);
    if (mark != known_marks().end()) given.marks.push_back({names[i], mark->second});
  }
  constexpr std::size_t kCodeOfImagej = 15;
  if (form == TableForm::imagej_piv && names.size() > kCodeOfImagej) {
    names[kCodeOfImagej] = "code";  // "flag" means another thing elsewhere
    given.marks.push_back({names[kCodeOfImagej], RowMark::code_of_imagej});
  }
  if (factors.are_there && !(factors.m_per_px == 1 && factors.m_per_s_per_px == 1))
    take_factors(given, name, factors, parameters);
  else
    take_units(given, name, found, parameters);
  if (factors.are_there && given.first == 0.5) given.first = -0.5;  // Tecplot's form, written by PIVlab
  given.sigma_um = given.displacement_um;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == given.sigma && found.units[i]) given.sigma_um = um_of(name, names[i], found.units[i], parameters);
  given.is_ours = is_ours;
  const bool is_asked = parameters.y_axis == VerticalAxis::up;
  const Order order = is_ours && !is_asked ? Order::none : order_of(table.rows, y);
  given.is_lattice = order != Order::none;
  const bool is_falling = parameters.y_axis == VerticalAxis::automatic && !is_ours && order == Order::falling;
  given.is_y_up = is_asked || is_falling;
  given.is_y_up_stated = !is_falling || form == TableForm::openpiv;
  if (form != TableForm::plain || !is_ours) {
    const std::string program = kPrograms[static_cast<std::size_t>(form)];
    given.how = (program.empty() ? "" : " as " + program + " writes them") + " (columns " +
                listed(std::vector<std::string>{given.x, given.y, given.ux, given.uy}) +
                (given.place_um == parameters.pixel_size_um ? "; px" : "") + (given.is_y_up ? "; y points up" : "") +
                ")";
  }
  expect_no_summary(table, *std::ranges::min_element(found.columns));
  given.rows = CsvTable(std::move(names), std::move(table.rows), name);
  return given;
}

}  // namespace mbtfm::beads
