/// The columns of a table, each declared once. What writes the table, reads it and describes it (docs/columns.md)
/// follows from there:
///
///   const Table<Tension> table{.file = "tensions.csv", .row = "the network and each fibre", .columns = {
///       {"fibre_id", "label of the fibre; 0: the actin network", &Tension::fibre_id, {.range = {.low = 0}}},
///       {"low_nN", "lower end of the 95 % interval", &Tension::low_nN, {.digits = 6, .may_lack = true}},
///       {"x_um", "place", [](auto& t) -> auto& { return t.position_um.x; }},
///       {"half_nN", "half the tension", [](const Tension& t) { return t.tension_nN / 2; }}}};  // written, never read
#pragma once

#include <algorithm>
#include <concepts>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/range.h"
#include "pipeline/contract/words.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/text.h"

namespace mbtfm::files {

inline constexpr int kForPeople = 6;  ///< digits of a result: a tenth of a millionth more than any error bar tells

struct ColumnOptions {
  Range range{};          ///< of a number, where it is read
  int digits = 0;         ///< significant ones; 0: all that it takes to read the same number again
  bool may_lack = false;  ///< a file without the column is read, too: the member stays as it is
};

template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

template <class T>
std::string field_of(const T& value, int digits) {
  if constexpr (kIsOptional<T>) {
    return value ? field_of(*value, digits) : std::string();
  } else if constexpr (std::is_same_v<T, bool>) {
    return value ? "TRUE" : "FALSE";
  } else if constexpr (std::is_floating_point_v<T>) {
    return digits > 0 ? significant(value, digits) : shortest(value);
  } else if constexpr (std::is_integral_v<T>) {
    return std::to_string(value);
  } else if constexpr (Worded<T>) {
    return name_of(value);
  } else {
    return std::string(value);
  }
}

/// @throws InputError naming the place of the field
template <class T>
T value_in(const CsvTable& table, int row, const std::string& column, const Range& range) {
  if constexpr (kIsOptional<T>) {
    if (table.text(row, column).empty()) return std::nullopt;
    return value_in<typename T::value_type>(table, row, column, range);
  } else if constexpr (std::is_same_v<T, bool>) {
    return table.truth(row, column);
  } else if constexpr (std::is_floating_point_v<T>) {
    return table.number(row, column, range);
  } else if constexpr (std::is_integral_v<T>) {
    return table.integer(row, column, smallest_integer(range));
  } else if constexpr (Worded<T>) {
    const auto value = named<T>(table.text(row, column));
    if (!value) table.fail(row, column, "one of " + listed(words(T{})));
    return *value;
  } else {
    return table.text(row, column);
  }
}

/// What its fields hold, for the page.
template <class T>
std::string kind_of(const Range& range) {
  if constexpr (kIsOptional<T>) {
    return kind_of<typename T::value_type>(range) + ", or empty";
  } else if constexpr (std::is_same_v<T, bool>) {
    return "`TRUE` or `FALSE`";
  } else if constexpr (std::is_floating_point_v<T>) {
    return describe("number", range);
  } else if constexpr (std::is_integral_v<T>) {
    return describe("whole number", range);
  } else if constexpr (Worded<T>) {
    return listed(words(T{}));
  } else {
    return "text";
  }
}

template <class Row>
struct Column {
  std::string name;     ///< with its unit
  std::string meaning;  ///< a phrase for the page
  std::string kind;     ///< what its fields hold
  bool may_lack = false;
  std::function<std::string(const Row&)> field;
  std::function<void(Row&, const CsvTable&, int row)> take;  ///< empty: the column is not read

  Column() = default;
  /// @param access  a member, or what gives a reference to it (read and written), or a value (written)
  template <class Access>
  Column(std::string column, std::string means, Access access, ColumnOptions options = {})
      : name(std::move(column)), meaning(std::move(means)), may_lack(options.may_lack) {
    using Result = std::invoke_result_t<Access, Row&>;
    using T = std::remove_cvref_t<Result>;
    kind = kind_of<T>(options.range);
    field = [=](const Row& row) { return field_of<T>(std::invoke(access, row), options.digits); };
    constexpr bool is_read = std::is_lvalue_reference_v<Result> && !std::is_const_v<std::remove_reference_t<Result>>;
    if constexpr (is_read) {
      take = [=, column = name](Row& row, const CsvTable& table, int at) {
        std::invoke(access, row) = value_in<T>(table, at, column, options.range);
      };
    }
  }
  /// What is not kept as it is written. @param get  of a row  @param put  into a row
  template <class Get, class Put>
  requires std::invocable<Put, Row&, std::invoke_result_t<Get, const Row&>> Column(std::string column,
                                                                                   std::string means, Get get, Put put,
                                                                                   ColumnOptions options = {})
      : Column(std::move(column), std::move(means), get, options) {
    take = [=, column = name](Row& row, const CsvTable& table, int at) {
      put(row, value_in<std::invoke_result_t<Get, const Row&>>(table, at, column, options.range));
    };
  }
};

template <class Row>
struct Table {
  std::string file;
  std::string row;  ///< what a row is of, for the page
  std::vector<Column<Row>> columns;
  std::string label = {};  ///< in messages a row is called after it and its first column: "adhesion 11"

  /// The same without some columns.
  Table without(const std::vector<std::string>& names) const {
    Table some = *this;
    std::erase_if(some.columns, [&](const auto& column) {
      return std::find(names.begin(), names.end(), column.name) != names.end();
    });
    return some;
  }
};

/// Columns of a part of the row, as another table has them.
/// @param part  a member, or what gives a reference to it
/// @param names  which; empty: all
template <class Row, class Part, class Access>
std::vector<Column<Row>> columns_of(const Table<Part>& table, Access part, const std::vector<std::string>& names = {}) {
  std::vector<Column<Row>> columns;
  for (const Column<Part>& of_part : table.columns) {
    if (!names.empty() && std::find(names.begin(), names.end(), of_part.name) == names.end()) continue;
    Column<Row>& column = columns.emplace_back();
    column.name = of_part.name;
    column.meaning = of_part.meaning;
    column.kind = of_part.kind;
    column.may_lack = of_part.may_lack;
    column.field = [part, field = of_part.field](const Row& row) { return field(std::invoke(part, row)); };
    if constexpr (!std::is_const_v<std::remove_reference_t<std::invoke_result_t<Access, Row&>>>) {
      if (!of_part.take) continue;
      column.take = [part, take = of_part.take](Row& row, const CsvTable& read, int at) {
        take(std::invoke(part, row), read, at);
      };
    }
  }
  return columns;
}

template <class Row>
std::vector<Column<Row>> joined(const std::vector<std::vector<Column<Row>>>& parts) {
  std::vector<Column<Row>> columns;
  for (const auto& part : parts) columns.insert(columns.end(), part.begin(), part.end());
  return columns;
}

template <class Row>
std::string text_of(const Table<Row>& table, const std::vector<Row>& rows) {
  std::vector<std::string> header;
  for (const auto& column : table.columns) header.push_back(column.name);
  CsvText csv(header);
  for (const Row& row : rows) {
    for (const auto& column : table.columns) csv.add(column.field(row));
    csv.end_row();
  }
  return csv.str();
}

template <class Row>
void write(const Path& file, const Table<Row>& table, const std::vector<Row>& rows) {
  write_text(file, text_of(table, rows));
}

/// @throws InputError naming file, line and column
template <class Row>
std::vector<Row> rows_of(CsvTable& csv, const Table<Row>& table) {
  for (const auto& column : table.columns) {
    if (column.take && !column.may_lack) csv.require({column.name});
  }
  if (!table.label.empty()) csv.label_rows_by(table.columns.front().name, table.label);
  std::vector<Row> rows(static_cast<std::size_t>(csv.n_rows()));
  for (const auto& column : table.columns) {
    if (!column.take || !csv.has(column.name)) continue;
    for (int row = 0; row < csv.n_rows(); ++row) column.take(rows[static_cast<std::size_t>(row)], csv, row);
  }
  return rows;
}

template <class Row>
std::vector<Row> read(const Path& file, const Table<Row>& table) {
  CsvTable csv(file);
  return rows_of(csv, table);
}

/// What the page says of it.
template <class Row>
std::string page_of(const Table<Row>& table) {
  std::string page =
      "\n## `" + table.file + "`\n\nA row for " + table.row + ".\n\n| column | is | values |\n|---|---|---|\n";
  for (const auto& c : table.columns)
    page += "| `" + c.name + "` | " + c.meaning + " | " + c.kind + (c.may_lack ? "; may be missing" : "") + " |\n";
  return page;
}

}  // namespace mbtfm::files
