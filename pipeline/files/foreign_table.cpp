#include "pipeline/files/foreign_table.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/files/names.h"
#include "pipeline/files/table_text.h"

namespace mbtfm::files {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";
constexpr std::string_view kHardBlank = "\xC2\xA0", kMinus = "\xE2\x88\x92";

std::string_view trimmed(std::string_view text) {
  for (std::size_t before = 0; text.size() != before;) {
    before = text.size();
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    text.remove_suffix(text.size() - (text.find_last_not_of(kBlanks) + 1));
    if (text.starts_with(kHardBlank)) text.remove_prefix(kHardBlank.size());
    if (text.ends_with(kHardBlank)) text.remove_suffix(kHardBlank.size());
  }
  return text;
}

struct Line {
  int number = 0;
  std::string_view text;
};

/// The next line with content. False at the end.
bool next(std::string_view& rest, Line& line) {
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    line.text = trimmed(rest.substr(0, end));
    // a separator of tabs is a blank, too: cells that are empty at the ends stay
    if (!line.text.empty()) line.text = rest.substr(0, end);
    rest.remove_prefix(end == rest.npos ? rest.size() : end + 1);
    ++line.number;
    if (!line.text.empty()) return true;
  }
  return false;
}

/// A cell in quotes, up to the separator after it; nothing where what begins with a quote does not end so.
std::optional<std::string> quoted(std::string_view line, std::size_t& at, char separator) {
  std::string value;
  for (std::size_t i = at + 1; i < line.size(); ++i) {
    if (line[i] != '"') {
      value += line[i];
      continue;
    }
    if (i + 1 < line.size() && line[i + 1] == '"') {
      value += line[i++];
      continue;
    }
    for (++i; i < line.size() && line[i] != separator && kBlanks.find(line[i]) != kBlanks.npos;) ++i;
    if (i < line.size() && line[i] != separator && separator != ' ') return std::nullopt;
    at = i;
    return std::string(trimmed(value));
  }
  return std::nullopt;
}

/// @param separator  ' ': any number of blanks
std::vector<std::string> cells_of(std::string_view line, char separator) {
  const bool by_blanks = separator == ' ';
  std::vector<std::string> cells;
  cells.reserve(8);
  std::size_t at = 0;
  while (true) {
    while (at < line.size() && line[at] != (by_blanks ? '\n' : separator) && kBlanks.find(line[at]) != kBlanks.npos)
      ++at;
    if (by_blanks && at >= line.size()) return cells;
    const bool has_quote = at < line.size() && line[at] == '"';
    if (auto cell = has_quote ? quoted(line, at, separator) : std::nullopt) {
      cells.push_back(std::move(*cell));
    } else {
      const std::size_t end =
          std::min(by_blanks ? line.find_first_of(kBlanks, at) : line.find(separator, at), line.size());
      cells.emplace_back(trimmed(line.substr(at, end - at)));
      at = end;
    }
    if (by_blanks) continue;
    if (at >= line.size()) return cells;
    ++at;  // the separator
  }
}

bool has_content(const std::vector<std::string>& cells) {
  return std::ranges::any_of(cells, [](const std::string& cell) { return !cell.empty(); });
}

bool has_letter_or_digit(std::string_view text) {
  return std::ranges::any_of(text, [](unsigned char c) { return std::isalnum(c) != 0 || c >= 0x80; });
}

/// "#N/A", "#NV", "#DIV/0!": what a spreadsheet writes for a number that it cannot compute.
bool is_error_of_spreadsheet(std::string_view cell) {
  return cell.size() > 2 && cell[0] == '#' && std::isupper(static_cast<unsigned char>(cell[1])) &&
         std::isupper(static_cast<unsigned char>(cell[2])) + (cell[2] == '/') > 0;
}

bool is_comment(std::string_view line) {
  line = trimmed(line);
  while (line.starts_with('"')) line.remove_prefix(1);
  return line.starts_with('%') || (line.starts_with('#') && !is_error_of_spreadsheet(line));
}

std::string_view without_comment_mark(std::string_view line) {
  if (!is_comment(line)) return line;
  return line.substr(std::min(line.find_first_not_of("#%\"", line.find_first_of("#%")), line.size()));
}

bool is_row_of_numbers(const Line& line, char separator, std::size_t n_numbers) {
  if (is_comment(line.text)) return false;
  std::size_t n = 0;
  bool has_word = false;  // beside dashes: "|---|---|" is none
  for (const std::string& cell : cells_of(line.text, separator)) {
    if (cell.empty() || (numeral_in(cell) == Numeral::none && !is_missing(cell))) continue;
    ++n;
    has_word = has_word || has_letter_or_digit(cell);
  }
  return has_word && n >= n_numbers;
}

/// `sep=;`, as Excel has it in the first line.
std::optional<char> take_separator(std::string_view& text, int& n_lines) {
  const std::string_view first = text.substr(0, text.find('\n'));
  std::string said = lower_case(std::string(trimmed(first)));
  std::erase(said, '"');
  if (!said.starts_with("sep=") || said.size() > 5 ||
      (said.size() == 5 && std::string_view(";,|").find(said[4]) == std::string_view::npos))
    return std::nullopt;
  text.remove_prefix(std::min(first.size() + 1, text.size()));
  ++n_lines;
  // a tab was trimmed off
  return said.size() > 4 ? said[4] : '\t';
}

constexpr std::array kSeparators = {';', '\t', ',', '|', ' '};

/// The one by which most of the first lines are rows of numbers.
char separator_of_numbers(std::string_view text, std::size_t n_numbers) {
  constexpr int kLooked = 200;  // lines: beyond any text above a table
  std::array<int, kSeparators.size()> n_rows{};
  Line line;
  for (int k = 0; k < kLooked && next(text, line); ++k)
    for (std::size_t s = 0; s < kSeparators.size(); ++s)
      n_rows[s] += is_row_of_numbers(line, kSeparators[s], n_numbers);
  return kSeparators[static_cast<std::size_t>(std::ranges::max_element(n_rows) - n_rows.begin())];
}

std::string letters_of(const std::string& name) {
  std::string letters = lower_case(name);
  std::erase_if(letters, [](unsigned char c) { return c < 0x80 && std::isalnum(c) == 0; });
  return letters;
}

/// Of columns whose names differ from ours by capitals and marks alone: "Exclude?", "x [um]".
void take_own_capitals(std::vector<std::string>& header, const std::vector<std::string>& columns) {
  for (const std::string& own : columns) {
    if (std::ranges::find(header, own) != header.end()) continue;
    const auto alike =
        std::ranges::find_if(header, [&](const std::string& name) { return letters_of(name) == letters_of(own); });
    if (alike != header.end()) *alike = own;
  }
}

std::string at(const std::string& name, int line) { return name + ":" + std::to_string(line); }

/// "1,234": with a comma for thousands it would be another number.
bool may_be_grouped(std::string_view cell) {
  cell = trimmed(cell);
  cell.remove_prefix(cell.starts_with('-') || cell.starts_with('+') ? 1 : 0);
  const std::size_t comma = cell.find(',');
  return comma >= 1 && comma <= 3 && cell.front() != '0' && cell.size() == comma + 4;
}

constexpr const char* kOneMark =
    "export the numbers with points for decimals and nothing between thousands: Excel does so with English number "
    "formats";

/// Decimal commas become points, where all the numbers together say that they are decimal.
/// @throws InputError where some numbers have points and others commas, or where all commas may divide thousands
void make_points(std::vector<CsvTable::Row>& rows, const std::string& name) {
  std::optional<std::pair<int, std::string>> comma, point;
  bool are_all_grouped = true;
  for (const CsvTable::Row& row : rows) {
    for (const std::string& cell : row.fields) {
      const Numeral numeral = numeral_in(cell);
      if (numeral == Numeral::with_point && !point) point.emplace(row.line, cell);
      if (numeral != Numeral::with_comma) continue;
      if (!comma) comma.emplace(row.line, cell);
      are_all_grouped = are_all_grouped && may_be_grouped(cell);
    }
  }
  if (!comma) return;
  if (point) {
    throw InputError(at(name, comma->first), "points or commas in the numbers, not both",
                     "'" + comma->second + "' here and '" + point->second + "' in line " + std::to_string(point->first),
                     kOneMark);
  }
  if (are_all_grouped) {
    throw InputError(at(name, comma->first), "numbers whose commas are plain",
                     "'" + comma->second + "', which may be " +
                         std::string(comma->second).replace(comma->second.find(','), 1, ".") +
                         " or a thousand times that",
                     kOneMark);
  }
  for (CsvTable::Row& row : rows)
    for (std::string& cell : row.fields)
      if (numeral_in(cell) == Numeral::with_comma) cell[cell.find(',')] = '.';
}

/// As std::from_chars reads it: without a plus, with the common minus, with an E before the exponent.
void make_plain(std::string& cell) {
  if (numeral_in(cell) == Numeral::none) return;
  if (cell.starts_with('+')) cell.erase(0, 1);
  if (cell.starts_with(kMinus)) cell.replace(0, kMinus.size(), "-");
  const std::size_t exponent = cell.find_first_of("dD");
  if (exponent != cell.npos) cell[exponent] = 'e';
}

/// @throws InputError where a row has more or less cells than the first. One that is empty may end all of them.
void expect_equal_widths(std::vector<CsvTable::Row>& rows, const std::string& name, char separator) {
  const std::size_t n = rows.front().fields.size();
  for (const CsvTable::Row& row : rows) {
    if (row.fields.size() == n) continue;
    const bool is_double = row.fields.size() == 2 * n && separator == ',';
    throw InputError(at(name, row.line), std::to_string(n) + " fields, as in line " + std::to_string(rows.front().line),
                     std::to_string(row.fields.size()),
                     is_double
                         ? kOneMark
                         : "take a line out that is no row of the table, or save the table again if it was cut off");
  }
}

}  // namespace

Numeral numeral_in(std::string_view cell) {
  if (cell.starts_with(kMinus))
    cell.remove_prefix(kMinus.size());
  else if (cell.starts_with('-') || cell.starts_with('+'))
    cell.remove_prefix(1);
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t n_digits = 0, i = 0;
  char mark = 0;
  for (; i < cell.size(); ++i) {
    if (is_digit(cell[i])) {
      ++n_digits;
    } else if ((cell[i] == '.' || cell[i] == ',') && mark == 0) {
      mark = cell[i];
    } else {
      break;
    }
  }
  // "01899" is what a comma between the cells leaves of 0,01899; "8," is a number and a separator
  const bool is_rest = mark == 0 && i > 1 && cell[0] == '0';
  if (n_digits == 0 || is_rest || (mark == ',' && cell[i - 1] == ',')) return Numeral::none;
  if (i < cell.size()) {
    if (std::string_view("eEdD").find(cell[i]) == std::string_view::npos) return Numeral::none;
    if (++i < cell.size() && (cell[i] == '-' || cell[i] == '+')) ++i;
    if (i == cell.size() || !std::all_of(cell.begin() + static_cast<std::ptrdiff_t>(i), cell.end(), is_digit))
      return Numeral::none;
  }
  return mark == 0 ? Numeral::whole : mark == '.' ? Numeral::with_point : Numeral::with_comma;
}

bool is_missing(std::string_view cell) {
  if (cell.empty() || is_error_of_spreadsheet(cell)) return true;
  constexpr std::size_t kLongest = 12;
  const bool is_of_windows = cell.find("1.#") < 2;  // "-1.#IND00", "1.#QNAN0"
  if (cell.size() > kLongest || is_of_windows || std::isdigit(static_cast<unsigned char>(cell.back())))
    return is_of_windows;
  std::string word;  // "n.d." is "nd", "--" is nothing
  for (const char c : lower_case(std::string(cell)))
    if (has_letter_or_digit({&c, 1})) word += c;
  for (const char* missing : {"", "nan", "na", "nd", "ndef", "inf", "infinity", "\xE2\x88\x9E", "none", "null",
                              "nanind", "nansnan", "nan0", "nannanj", "missing", "masked", "invalid", "undefined"})
    if (word == missing) return true;
  return false;
}

namespace {

/// Rows right above the first one that are like it but have nothing where a number is missing: "8.0;8.0;;".
void take_rows_with_gaps(ForeignTable& table, std::size_t n_numbers) {
  const auto is_number = [](const std::string& cell) { return numeral_in(cell) != Numeral::none; };
  while (!table.above.empty()) {
    const std::vector<std::string>& cells = table.above.back().fields;
    const bool is_row = cells.size() == table.rows.front().fields.size() &&
                        2 * static_cast<std::size_t>(std::ranges::count_if(cells, is_number)) >= n_numbers &&
                        std::ranges::all_of(cells, [&](auto& cell) { return is_number(cell) || is_missing(cell); });
    if (!is_row) return;
    table.rows.insert(table.rows.begin(), std::move(table.above.back()));
    table.above.pop_back();
    table.lines_above.pop_back();
  }
}

}  // namespace

ForeignTable read_numbers(std::string_view bytes, std::string name, std::size_t n_numbers) {
  std::string place;
  std::string_view text = as_text(bytes, place);
  Line line;
  const std::optional<char> said = take_separator(text, line.number);
  const char separator = said ? *said : separator_of_numbers(text, n_numbers);
  ForeignTable table{.name = std::move(name), .separator = separator, .above = {}, .lines_above = {}, .rows = {}};
  table.rows.reserve(static_cast<std::size_t>(std::ranges::count(text, '\n')) + 1);
  for (std::string_view rest = text; next(rest, line);) {
    const bool is_above = table.rows.empty() && !is_row_of_numbers(line, separator, n_numbers);
    if (!is_above && is_comment(line.text)) continue;
    const std::string_view content = is_above ? trimmed(without_comment_mark(line.text)) : line.text;
    CsvTable::Row row{line.number, cells_of(content, separator)};
    if (!has_content(row.fields)) continue;
    if (is_above) table.lines_above.emplace_back(content);
    (is_above ? table.above : table.rows).push_back(std::move(row));
  }
  if (table.rows.empty()) {
    throw InputError(
        table.name, "rows of " + std::to_string(n_numbers) + " numbers or more", "none",
        "a row for each vector, its numbers between commas, semicolons, tabs or blanks, with one decimal mark, without "
        "a mark between thousands or a unit beside them");
  }
  expect_equal_widths(table.rows, table.name, separator);
  take_rows_with_gaps(table, n_numbers);
  const bool may_have_commas = text.find(',') != text.npos && (separator != ',' || text.find('"') != text.npos);
  if (may_have_commas) make_points(table.rows, table.name);
  if (text.find_first_of("+dD\xE2") == text.npos) return table;
  for (CsvTable::Row& row : table.rows) std::ranges::for_each(row.fields, make_plain);
  return table;
}

CsvTable read_columns(std::string_view bytes, std::string name, const std::vector<std::string>& columns) {
  ForeignTable table = read_numbers(bytes, std::move(name), columns.size());
  for (std::size_t k = table.above.size(); k-- > 0;) {
    std::vector<std::string>& header = table.above[k].fields;
    take_own_capitals(header, columns);
    const auto is_there = [&](const std::string& own) { return std::ranges::find(header, own) != header.end(); };
    if (header.size() == table.rows.front().fields.size() && std::ranges::all_of(columns, is_there))
      return {std::move(header), std::move(table.rows), std::move(table.name)};
  }
  throw InputError(table.name + ":1", "the columns " + listed(columns),
                   table.above.empty() ? "no row of names" : listed(table.above.back().fields),
                   "name the columns so in the row above the numbers");
}

CsvTable read_records(std::string_view bytes, std::string name, const std::string& column,
                      const std::vector<std::string>& columns) {
  std::string place;
  std::string_view text = as_text(bytes, place);
  Line line;
  const std::optional<char> said = take_separator(text, line.number);
  std::vector<std::string> header, first;
  std::vector<CsvTable::Row> rows;
  char separator = said.value_or(',');
  for (std::string_view rest = text; next(rest, line);) {
    if (header.empty()) {
      // names of cells have blanks in them: these divide none
      for (const char tried : {separator, ';', '\t'}) {
        std::vector<std::string> names = cells_of(without_comment_mark(line.text), said ? *said : tried);
        if (first.size() < names.size()) first = names;
        if (!header.empty() || std::ranges::find(names, column, lower_case) == names.end()) continue;
        separator = said ? *said : tried;
        header = std::move(names);
      }
      continue;
    }
    CsvTable::Row row{line.number, cells_of(line.text, separator)};
    const bool is_cut = std::ranges::any_of(row.fields, [](const std::string& cell) { return cell.starts_with('"'); });
    if (const int n = is_cut ? take_quoted_breaks(rest, line.text) : 0; n > 0) {
      row.fields = cells_of(line.text, separator);
      line.number += n;
    }
    if (!has_content(row.fields)) continue;
    while (row.fields.size() > header.size() && row.fields.back().empty()) row.fields.pop_back();
    if (row.fields.size() != header.size()) {
      throw InputError(at(name, row.line), std::to_string(header.size()) + " fields, as in the header",
                       std::to_string(row.fields.size()), "put a text with a separator in it in quotes");
    }
    rows.push_back(std::move(row));
  }
  if (header.empty()) {
    throw InputError(name + ":1", "a column '" + column + "'", "the columns " + listed(first),
                     "the first row names the columns, one of them '" + column + "'");
  }
  for (std::size_t i = 0; i < header.size(); ++i)
    if (header[i].empty()) header[i] = "column " + std::to_string(i + 1);
  take_own_capitals(header, columns);
  return {std::move(header), std::move(rows), std::move(name)};
}

}  // namespace mbtfm::files
