/// Tables as people and other programs write them, taken apart into rows of cells. What one stage of ours hands to the
/// next stays strict (csv.h). Commas, semicolons, tabs or blanks between the cells, with or without quotes and blanks
/// around them; UTF-8 or UTF-16; any line ends; `sep=`; points or commas in the numbers. Rows without content are none.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/files/csv.h"

namespace mbtfm::files {

/// What a text of a number looks like.
enum class Numeral { none, whole, with_point, with_comma };
/// A decimal mark at most, an exponent (1.5D-3, too), blanks around it: "1.234,5" and "1 234" are none.
Numeral numeral_in(std::string_view cell);
/// Words for a missing number: NaN, NA, \#N/A and other errors of spreadsheets, infinite, nothing at all.
bool is_missing(std::string_view cell);

struct ForeignTable {
  std::string name;
  char separator = ',';                  ///< ' ': any number of blanks
  std::vector<CsvTable::Row> above;      ///< lines before the first row of numbers, without the `#` or `%` before them
  std::vector<std::string> lines_above;  ///< the same as they are
  std::vector<CsvTable::Row> rows;       ///< from there on: all with as many cells; numbers as std::from_chars has them
};

/// Rows with `n_numbers` numbers or more. Their decimal mark is decided by all of them together.
/// @throws InputError where there are none, a row has more or less cells than the first, or the mark is ambiguous
ForeignTable read_numbers(std::string_view bytes, std::string name, std::size_t n_numbers);

/// The same with a header: the lowest row above the numbers that has all `columns`, whatever their capitals. There they
/// get these. @throws InputError
CsvTable read_columns(std::string_view bytes, std::string name, const std::vector<std::string>& columns);

/// A table with a header: the first row that has `column`, whatever its capitals. `columns` get their own capitals.
/// @throws InputError
CsvTable read_records(std::string_view bytes, std::string name, const std::string& column,
                      const std::vector<std::string>& columns);

}  // namespace mbtfm::files
