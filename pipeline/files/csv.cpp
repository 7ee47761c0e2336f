#include "pipeline/files/csv.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/contract/place.h"
#include "pipeline/files/names.h"
#include "pipeline/files/text.h"

namespace mbtfm::files {

namespace {

/// Splits the text of a table into records of fields.
class Splitter {
 public:
  Splitter(std::string_view text, const std::string& name) : text_(text), name_(name) {
    if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);  // byte order mark, as Excel writes it
  }

  bool at_end() const { return at_ >= text_.size(); }
  int line() const { return line_; }

  std::vector<std::string> record() {
    std::vector<std::string> fields;
    bool is_last = false;
    while (!is_last) fields.push_back(field(is_last));
    return fields;
  }

 private:
  std::string field(bool& is_last) {
    std::string value;
    const bool is_quoted = !at_end() && text_[at_] == '"';
    if (is_quoted) {
      ++at_;
      while (true) {
        if (at_end()) fail("a closing quote", "the end of the file");
        const char c = text_[at_++];
        if (c == '\n') ++line_;
        if (c == '"') {
          if (at_end() || text_[at_] != '"') break;
          ++at_;
        }
        value += c;
      }
    } else {
      while (!at_end() && text_[at_] != ',' && text_[at_] != '\n' && text_[at_] != '\r') value += text_[at_++];
    }
    if (at_end()) fail("a line break after the last row", "the end of the file", "the file may have been cut off");
    if (text_[at_] == ',') {
      ++at_;
      is_last = false;
      return value;
    }
    if (text_[at_] == '\r') ++at_;
    if (at_end() || text_[at_] != '\n') fail("a comma or a line break after a field", "other text");
    ++at_;
    ++line_;
    is_last = true;
    return value;
  }

  [[noreturn]] void fail(const std::string& expected, const std::string& found, const std::string& hint = {}) const {
    throw InputError(name_ + ":" + std::to_string(line_), expected, found, hint);
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
  int line_ = 1;
};

}  // namespace

CsvTable::CsvTable(const std::filesystem::path& file) : CsvTable(read_text(file), file.string()) {}

CsvTable::CsvTable(std::string_view text, std::string name) : name_(std::move(name)) {
  if (text.empty()) throw InputError(name_ + ":1", "a header line", "an empty file");
  if (text.find('\0') != text.npos)
    throw InputError(name_, "a table (CSV)", "a picture or another binary file", "is this the right file?");
  Splitter splitter(text, name_);
  header_ = splitter.record();
  if (header_.size() == 1 && header_.front().find_first_of(";\t") != std::string::npos) {
    throw InputError(name_ + ":1", "columns with commas between them",
                     header_.front().find(';') != std::string::npos ? "semicolons" : "tabs",
                     "save it as CSV with commas, and with points in the numbers: Excel does so with English number "
                     "formats, R with write.csv(), pandas with to_csv()");
  }
  expect_each_column_once();
  while (!splitter.at_end()) {
    Row row{.line = splitter.line(), .fields = splitter.record()};
    if (row.fields.size() != header_.size()) {
      throw InputError(name_ + ":" + std::to_string(row.line),
                       std::to_string(header_.size()) + " fields, as in the header", std::to_string(row.fields.size()),
                       "take rows out that are none; displacements of other programs: mbtfm-track --displacement");
    }
    rows_.push_back(std::move(row));
  }
}

CsvTable::CsvTable(std::vector<std::string> header, std::vector<Row> rows, std::string name)
    : name_(std::move(name)), header_(std::move(header)), rows_(std::move(rows)) {
  expect_each_column_once();
}

void CsvTable::expect_each_column_once() const {
  std::unordered_set<std::string> seen;
  for (const std::string& column : header_)
    if (!seen.insert(column).second) throw InputError(name_ + ":1", "each column once", "'" + column + "' twice");
}

bool CsvTable::has(std::string_view column) const {
  return std::find(header_.begin(), header_.end(), column) != header_.end();
}

void CsvTable::require(const std::vector<std::string>& columns) const {
  for (const std::string& column : columns) index_of(column);
}

int CsvTable::index_of(const std::string& column) const {
  const auto at = std::find(header_.begin(), header_.end(), column);
  if (at != header_.end()) return static_cast<int>(at - header_.begin());
  const auto alike = std::ranges::find(header_, lower_case(column), lower_case);
  throw InputError(name_ + ":1", "a column '" + column + "'", "the columns " + listed(header_),
                   alike == header_.end() ? "" : "write '" + *alike + "' as '" + column + "': capitals count");
}

void CsvTable::label_rows_by(const std::string& column, const std::string& kind) {
  std::unordered_set<int> seen;
  for (int row = 0; row < n_rows(); ++row)
    if (!seen.insert(integer(row, column, 0)).second) fail(row, column, "each label once");
  label_column_ = column;
  label_kind_ = kind;
}

void CsvTable::fail(int row, const std::string& column, const std::string& expected, const std::string& hint) const {
  std::string where = name_ + ":" + std::to_string(rows_[row].line) + ": column '" + column + "'";
  if (!label_column_.empty()) where += " of " + label_kind_ + " " + rows_[row].fields[index_of(label_column_)];
  throw InputError(where, expected, "'" + rows_[row].fields[index_of(column)] + "'", hint);
}

std::string CsvTable::text(int row, const std::string& column) const { return rows_[row].fields[index_of(column)]; }

namespace {

/// What a number of this column can be at all, whatever it is asked for.
Range possible(const std::string& column) {
  constexpr double kLargest = 1e30;  // powers of larger ones are no numbers; no unit of ours has such
  return column.ends_with("_um") ? possible_place_um() : Range::between(-kLargest, kLargest);
}

}  // namespace

double CsvTable::number(int row, const std::string& column, Range range) const {
  const auto value = parsed<double>(rows_[row].fields[index_of(column)]);
  if (!value || !std::isfinite(*value) || !is_inside(range, *value)) fail(row, column, describe("a number", range));
  if (!is_inside(possible(column), *value)) fail(row, column, describe("a number", possible(column)));
  return *value;
}

std::optional<double> CsvTable::optional_number(int row, const std::string& column) const {
  if (text(row, column).empty()) return std::nullopt;
  return number(row, column);
}

int CsvTable::integer(int row, const std::string& column, int smallest) const {
  const auto value = parsed<int>(rows_[row].fields[index_of(column)]);
  if (!value || *value < smallest) fail(row, column, "an integer >= " + std::to_string(smallest));
  return *value;
}

bool CsvTable::truth(int row, const std::string& column) const {
  const std::string& field = rows_[row].fields[index_of(column)];
  const bool is_true = field == "TRUE" || field == "true" || field == "True";
  if (!is_true && field != "FALSE" && field != "false" && field != "False") fail(row, column, "TRUE or FALSE");
  return is_true;
}

int smallest_integer(const Range& range) {
  constexpr int kLeast = std::numeric_limits<int>::min();
  return range.low < kLeast ? kLeast : static_cast<int>(range.low);
}

CsvText::CsvText(const std::vector<std::string>& header) {
  for (const std::string& column : header) add(column);
  end_row();
}

CsvText& CsvText::add(std::string_view text) {
  const std::string value = shown_name(text);
  if (is_row_begun_) text_ += ',';
  is_row_begun_ = true;
  if (value.find_first_of(",\"\r\n") == std::string::npos) {
    text_ += value;
    return *this;
  }
  text_ += '"';
  for (const char c : value) text_ += c == '"' ? std::string("\"\"") : std::string(1, c);
  text_ += '"';
  return *this;
}

CsvText& CsvText::add(double value) { return add(std::string_view(shortest(value))); }
CsvText& CsvText::add(int value) { return add(std::string_view(std::to_string(value))); }

void CsvText::end_row() {
  text_ += '\n';
  is_row_begun_ = false;
}

}  // namespace mbtfm::files
