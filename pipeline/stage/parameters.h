/// Parameters, declared once. One struct a stage; one function `declare(ParameterList&, Struct&)` names each member,
/// and from it come the flags, the tables of cell.toml, --help, the parameter page and the provenance.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pipeline/contract/gel.h"
#include "pipeline/contract/range.h"

namespace mbtfm::stage {

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

}  // namespace mbtfm::stage
