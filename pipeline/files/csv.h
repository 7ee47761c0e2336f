/// Strict RFC 4180 tables: first line the header, no comments, shortest round-trip numbers, an empty field is a missing
/// value, the last line ends with a line break.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/range.h"

namespace mbtfm::files {

class CsvTable {
 public:
  struct Row {
    int line = 0;
    std::vector<std::string> fields;
  };
  /// @throws InputError with the line where fields are missing or too many, a quote is open or the end is early
  explicit CsvTable(const std::filesystem::path& file);
  CsvTable(std::string_view text, std::string name);
  /// Of a table that was taken apart elsewhere: each row has as many fields as the header. @throws InputError
  CsvTable(std::vector<std::string> header, std::vector<Row> rows, std::string name);

  int n_rows() const { return static_cast<int>(rows_.size()); }
  bool has(std::string_view column) const;
  /// @throws InputError naming the columns that lack
  void require(const std::vector<std::string>& columns) const;
  /// In messages a row is called after this column: "adhesion 11". @throws InputError where a label is there twice
  void label_rows_by(const std::string& column, const std::string& kind);

  std::string text(int row, const std::string& column) const;
  double number(int row, const std::string& column, Range range = Range::any()) const;
  std::optional<double> optional_number(int row, const std::string& column) const;
  int integer(int row, const std::string& column, int smallest) const;
  bool truth(int row, const std::string& column) const;  ///< TRUE, True and true are true

  [[noreturn]] void fail(int row, const std::string& column, const std::string& expected,
                         const std::string& hint = {}) const;

 private:
  void expect_each_column_once() const;
  int index_of(const std::string& column) const;
  std::string name_;
  std::vector<std::string> header_;
  std::vector<Row> rows_;
  std::string label_column_, label_kind_;
};

/// Of a range of whole numbers, its lower end.
int smallest_integer(const Range& range);

/// Collects rows and writes them whole.
class CsvText {
 public:
  explicit CsvText(const std::vector<std::string>& header);
  CsvText& add(double value);
  CsvText& add(int value);
  CsvText& add(std::string_view value);
  CsvText& add(const char* value) { return add(std::string_view(value)); }
  CsvText& add(const std::optional<double>& value) { return value ? add(*value) : add(""); }
  CsvText& add(const std::optional<int>& value) { return value ? add(*value) : add(""); }
  void end_row();
  const std::string& str() const { return text_; }

 private:
  std::string text_;
  bool is_row_begun_ = false;
};

}  // namespace mbtfm::files
