/// The columns of a table, each declared once. What writes the table, reads it and describes it (docs/columns.md)
/// follows from there:
///
///   const Table<Tension> table{.file = "tensions.csv", .columns = {
///       {"fibre_id", &Tension::fibre_id, {.range = {.low = 0}}},
///       {"low_nN", &Tension::low_nN, {.digits = 6, .may_lack = true}},
///       {"x_um", member(&Tension::position_um, &Vec2::x)},
///       {"half_nN", [](const Tension& t) { return t.tension_nN / 2; }}}};  // written, never read
///
/// What a column means is in columns.txt.
/// A column knows where in a row its value lies and of which type it is, so that the compiler has one reader and one
/// writer for each type and not for each column.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/range.h"
#include "pipeline/contract/words.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/text.h"

namespace mbtfm::files {

inline constexpr int kForPeople = 6;  ///< digits of a result: a tenth of a millionth more than any error bar resolves

struct ColumnOptions {
  Range range{};          ///< of a number, where it is read
  int digits = 0;         ///< significant ones; 0: all that it takes to read the same number again
  bool may_lack = false;  ///< a file without the column is read, too: the member stays as it is
};

inline constexpr ColumnOptions kId = {.range = {.low = 1}};
inline constexpr ColumnOptions kMayLack = {.may_lack = true};
inline constexpr ColumnOptions kResult = {.digits = kForPeople};
inline constexpr ColumnOptions kResultMayLack = {.digits = kForPeople, .may_lack = true};

template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

template <class T>
std::string field_of(const T& value, int digits) {
  if constexpr (kIsOptional<T>)
    return value ? field_of(*value, digits) : std::string();
  else if constexpr (std::is_same_v<T, bool>)
    return value ? "TRUE" : "FALSE";
  else if constexpr (std::is_floating_point_v<T>)
    return digits > 0 ? significant(value, digits) : shortest(value);
  else if constexpr (std::is_integral_v<T>)
    return std::to_string(value);
  else if constexpr (Worded<T>)
    return name_of(value);
  else
    return std::string(value);
}

/// @throws InputError naming the place of the field
template <class T>
void take(T& value, const CsvTable& table, int row, const std::string& column, const Range& range) {
  if constexpr (kIsOptional<T>) {
    value.reset();
    if (!table.text(row, column).empty()) take(value.emplace(), table, row, column, range);
  } else if constexpr (std::is_same_v<T, bool>) {
    value = table.truth(row, column);
  } else if constexpr (std::is_floating_point_v<T>) {
    value = table.number(row, column, range);
  } else if constexpr (std::is_integral_v<T>) {
    value = table.integer(row, column, smallest_integer(range));
  } else if constexpr (Worded<T>) {
    const auto named_value = named<T>(table.text(row, column));
    if (!named_value) table.fail(row, column, "one of " + listed(words(T{})));
    value = *named_value;
  } else {
    value = table.text(row, column);
  }
}

/// What its fields hold, for the page.
template <class T>
std::string kind_of(const Range& range) {
  if constexpr (kIsOptional<T>)
    return kind_of<typename T::value_type>(range).append(", or empty");
  else if constexpr (std::is_same_v<T, bool>)
    return "`TRUE` or `FALSE`";
  else if constexpr (std::is_floating_point_v<T>)
    return describe("number", range);
  else if constexpr (std::is_integral_v<T>)
    return describe("whole number", range);
  else if constexpr (Worded<T>)
    return listed(words(T{}));
  else
    return "text";
}

/// The same of a value whose type is forgotten.
struct FieldType {
  std::string (*field)(const void* value, int digits);
  void (*take)(void* value, const CsvTable& table, int row, const std::string& column, const Range& range);
  std::string (*kind)(const Range& range);
};
template <class T>
inline constexpr FieldType kFieldType = {
    [](const void* value, int digits) { return field_of(*static_cast<const T*>(value), digits); },
    [](void* value, const CsvTable& table, int row, const std::string& column, const Range& range) {
      take(*static_cast<T*>(value), table, row, column, range);
    },
    kind_of<T>};

/// From a row to a value in it.
class Way {
 public:
  using Function = void (*)();
  /// From what lies here to what lies elsewhere; null: there is none.
  using Through = const void* (*)(const void* here, Function function);

  Way() = default;
  explicit Way(std::ptrdiff_t offset) : offset_(offset) {}
  /// Another piece at its end. @param may_end  there may be none
  void go(Through through, Function function, bool may_end);
  void go(const Way& on);

  bool may_end() const { return may_end_; }
  bool is_in_row() const { return n_ == 0; }
  const void* from(const void* row) const;
  void* from(void* row) const { return static_cast<char*>(row) + offset_; }  ///< where the value is in the row

 private:
  struct Piece {
    std::ptrdiff_t offset = 0;
    Through through = nullptr;
    Function function = nullptr;
  };
  std::array<Piece, 3> pieces_{};
  int n_ = 0;
  std::ptrdiff_t offset_ = 0;  ///< after them
  bool may_end_ = false;
};

/// A T in a row.
template <class Row, class T>
struct Member {
  using Whole = Row;
  using Type = T;
  Way way;
};

template <class Row, class T>
requires std::is_object_v<T> Member<Row, T> member(T Row::*of) {
  alignas(Row) char place[sizeof(Row)];  // where nothing is read
  const auto* row = reinterpret_cast<const Row*>(place);
  return {Way(reinterpret_cast<const char*>(&(row->*of)) - place)};
}
/// What belongs to a row and is elsewhere: the column is not read. @param of  gives a reference, or a pointer: where
/// that is null the field is empty
template <class Row, class Result>
auto member(Result (*of)(const Row&)) {
  constexpr bool kMayEnd = std::is_pointer_v<Result>;
  Member<Row, std::remove_const_t<std::remove_pointer_t<std::remove_reference_t<Result>>>> found;
  const auto through = [](const void* row, Way::Function function) -> const void* {
    auto&& there = reinterpret_cast<Result (*)(const Row&)>(function)(*static_cast<const Row*>(row));
    if constexpr (kMayEnd)
      return there;
    else
      return &there;
  };
  found.way.go(through, reinterpret_cast<Way::Function>(of), kMayEnd);
  return found;
}

template <class Row, class Part, class Whole, class T>
Member<Row, T> joined(Member<Row, Part> first, const Member<Whole, T>& then) {
  if constexpr (!std::is_base_of_v<Whole, Part>) {  // a pointer or an optional
    const auto through = [](const void* here, Way::Function) -> const void* {
      const auto& part = *static_cast<const Part*>(here);
      return part ? static_cast<const Whole*>(&*part) : nullptr;
    };
    first.way.go(through, nullptr, true);
  }
  first.way.go(then.way);
  return {first.way};
}
/// Of a part of the row: member(&Row::fibre, &Fibre::width_um). Where a pointer or an optional on the way is empty the
/// field is, too.
template <class First, class Second, class... Rest>
auto member(First first, Second second, Rest... rest) {
  return joined(member(first), member(second, rest...));
}

/// The components of a Vec2 or a Vec3.
template <class... To>
auto x_of(To... vector) {
  using V = typename decltype(member(vector...))::Type;
  return member(vector..., &V::x);
}
template <class... To>
auto y_of(To... vector) {
  using V = typename decltype(member(vector...))::Type;
  return member(vector..., &V::y);
}
template <class... To>
auto z_of(To... vector) {
  using V = typename decltype(member(vector...))::Type;
  return member(vector..., &V::z);
}

/// A column of rows of any type.
struct AnyColumn {
  std::string name;  ///< with its unit
  ColumnOptions options;
  Way way;
  const FieldType* type = nullptr;
  std::function<std::string(const void* part, int digits)> get;  ///< of what is not kept as it is written
  std::function<void(void* part, const CsvTable&, int row, const AnyColumn&)> put;

  bool is_read() const { return way.is_in_row() && (!get || put); }
};

class AnyColumns {
 public:
  std::string text_of(const void* rows, std::size_t n_rows, std::size_t size) const;
  void take(void* rows, std::size_t size, CsvTable& table, const char* label) const;
  std::string page_of(const char* file) const;

  /// @param part  which they are columns of
  void add(const AnyColumns& more, const Way& part = {});

 protected:
  AnyColumns() = default;
  AnyColumns(std::string_view name, const Way& way, const FieldType& type, const ColumnOptions& options);
  AnyColumns(const AnyColumns&);
  AnyColumns& operator=(const AnyColumns&);
  ~AnyColumns();
  void keep(const std::vector<std::string>& names, bool are_kept);

  std::vector<AnyColumn> all_;
};

/// One or several: lists may be nested.
template <class Row>
class Columns : public AnyColumns {
  template <class Get, class Result = std::remove_cvref_t<std::invoke_result_t<Get, const Row&>>>
  using Value = std::conditional_t<std::is_convertible_v<Result, std::string_view>, std::string, Result>;

 public:
  Columns() = default;
  Columns(std::initializer_list<Columns> parts) {
    for (const Columns& part : parts) add(part);
  }
  template <class T>
  Columns(std::string_view name, const Member<Row, T>& of, const ColumnOptions& options = {})
      : AnyColumns(name, of.way, kFieldType<T>, options) {}
  template <class T>
  requires std::is_object_v<T> Columns(std::string_view name, T Row::*of, const ColumnOptions& options = {})
      : Columns(name, member(of), options) {}
  /// What is not kept as it is written: it is not read.
  template <std::invocable<const Row&> Get>
  requires(!std::is_member_pointer_v<Get>) Columns(std::string_view name, Get get, const ColumnOptions& options = {})
      : AnyColumns(name, Way(), kFieldType<Value<Get>>, options) {
    all_.back().get = [get](const void* row, int digits) {
      return field_of(get(*static_cast<const Row*>(row)), digits);
    };
  }
  /// The same, read by another function. @param put  into a row
  template <class Get, std::invocable<Row&, std::invoke_result_t<Get, const Row&>> Put>
  Columns(std::string_view name, Get get, Put put, const ColumnOptions& options = {}) : Columns(name, get, options) {
    all_.back().put = [put](void* row, const CsvTable& table, int at, const AnyColumn& column) {
      std::invoke_result_t<Get, const Row&> value{};
      column.type->take(&value, table, at, column.name, column.options.range);
      put(*static_cast<Row*>(row), value);
    };
  }
  void push_back(const Columns& more) { add(more); }
  Columns only(const std::vector<std::string>& names) const {
    Columns some = *this;
    some.keep(names, true);
    return some;
  }
  Columns without(const std::vector<std::string>& names) const {
    Columns some = *this;
    some.keep(names, false);
    return some;
  }
};

/// Columns of a part of the row, as another table has them. @param part  as of member()
template <class Access, class Part>
auto columns_of(Access part, const Columns<Part>& its) {
  Columns<typename decltype(member(part))::Whole> columns;
  columns.add(its, joined(member(part), Member<Part, Part>{}).way);
  return columns;
}

template <class Row>
struct Table {
  const char* file = "";
  Columns<Row> columns;
  const char* label = "";  ///< in messages a row is called after it and its first column: "adhesion 11"
};

template <class Row>
std::string text_of(const Table<Row>& table, const std::vector<Row>& rows) {
  return table.columns.text_of(rows.data(), rows.size(), sizeof(Row));
}

template <class Row>
void write(const Path& file, const Table<Row>& table, const std::vector<Row>& rows) {
  write_text(file, text_of(table, rows));
}

/// @throws InputError naming file, line and column
template <class Row>
std::vector<Row> rows_of(CsvTable& csv, const Table<Row>& table) {
  std::vector<Row> rows(static_cast<std::size_t>(csv.n_rows()));
  table.columns.take(rows.data(), sizeof(Row), csv, table.label);
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
  return table.columns.page_of(table.file);
}

}  // namespace mbtfm::files
