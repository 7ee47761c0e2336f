/// Parameters, declared once. One struct a stage; one function `declare(ParameterList&, Struct&)` names each member,
/// and from it come the flags, the tables of cell.toml, --help, the parameter page and the provenance.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pipeline/contract/types.h"

namespace mbtfm {

/// An interval of allowed values.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool excludes_low = false;
  bool excludes_high = false;
  static Range any() { return {}; }
  static Range positive() { return {.low = 0, .excludes_low = true}; }
  static Range not_negative() { return {.low = 0}; }
  static Range between(double low, double high) { return {.low = low, .high = high}; }
  // What a quantity can be at all in a cell or its gel, with a margin of ten or more: a value beyond is a slip.
  static Range size_um() { return between(1e-3, 1000); }       ///< of a part of a cell: a molecule to ten cells
  static Range zero_or_size_um() { return between(0, 1000); }  ///< the same, or none
  static Range pixel_um() { return between(1e-3, 20); }        ///< 0.005 in an expanded gel to 6.5 without a lens
  static Range mesh_um() { return between(0.01, 100); }        ///< of a mesh, a lattice: a protein to a cell
  static Range area_um2() { return between(1e-6, 1e6); }       ///< (size_um)²
  static Range modulus_kPa() { return between(1e-3, 1e6); }    ///< mucus to hard plastic
  static Range thickness_um() { return between(0.1, 1e5); }    ///< of a gel: a coating to a block in the hand
  static Range force_nN() { return between(1e-6, 1e6); }       ///< a thousandth of a motor protein to many cells
  static Range factor() { return between(1e-6, 1e6); }         ///< of a ratio that must be there
  static Range zero_or_factor() { return between(0, 1e6); }    ///< of a ratio or a spread that may be none
};

bool is_inside(const Range& range, double value);
/// "a number > 0", for messages and the parameter page.
std::string describe(const std::string& noun, const Range& range);

/// "the unit is kPa: 8400 Pa is 8.4 kPa": where the value is outside the range as it stands, and inside it in a unit a
/// thousand times smaller or larger. Empty where it is not. @param name  with its unit
std::string unit_slip(std::string_view name, double value, const Range& range);

struct Parameter {
  std::string table;  ///< of cell.toml; empty: above the first table
  std::string name;   ///< key in the table, and the flag --name
  std::variant<double*, std::optional<double>*, int*, std::optional<int>*, std::uint64_t*, bool*, std::string*> member;
  Range range;
  std::vector<std::string> choices;  ///< of a string; empty: any
  std::string meaning;               ///< one sentence, with the unit
  std::string default_value;         ///< as printed
  bool is_required = false;
  bool is_set = false;
};

class ParameterList {
 public:
  /// The following parameters belong to [name] of cell.toml.
  void table(std::string name) { table_ = std::move(name); }
  void add(std::string name, double& member, Range range, std::string meaning);
  /// May stay unset; `meaning` says what holds then.
  void add(std::string name, std::optional<double>& member, Range range, std::string meaning);
  void add(std::string name, int& member, Range range, std::string meaning);
  void add(std::string name, std::optional<int>& member, Range range, std::string meaning);
  void add(std::string name, std::uint64_t& member, std::string meaning);
  void add(std::string name, bool& member, std::string meaning);
  void add(std::string name, std::string& member, std::string meaning, std::vector<std::string> choices = {});
  /// The parameter added last has no default.
  void required() { parameters_.back().is_required = true; }

  std::vector<Parameter>& all() { return parameters_; }
  const std::vector<Parameter>& all() const { return parameters_; }

 private:
  void add(Parameter parameter);
  std::string table_;
  std::vector<Parameter> parameters_;
};

/// Set the list's members from a cell.toml. Tables of other stages are left to them; unknown tables, and unknown or
/// repeated keys in the list's own tables are errors that name the nearest known one. @throws InputError
void read_toml(ParameterList& list, const std::filesystem::path& file);
/// The same, of the text of a file called `name` in messages.
void read_toml(ParameterList& list, std::string_view text, const std::string& name);
/// Set one parameter from text, as a flag does. @throws UsageError
void set_from_text(Parameter& parameter, const std::string& text);
std::string to_text(const Parameter& parameter);
/// The parameter of this name. @throws UsageError that names the nearest one there is
Parameter& parameter_named(ParameterList& list, const std::string& name);
/// @throws UsageError where a required parameter was never set
void check_complete(const ParameterList& list);
/// The parameter page of this list: one table of name, default, range, meaning for each table of cell.toml.
std::string to_markdown(const ParameterList& list);

void declare(ParameterList& list, Gel& gel);

}  // namespace mbtfm
