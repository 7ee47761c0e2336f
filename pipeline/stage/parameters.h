/// Parameters, declared once. One struct a stage; one function `declare(ParameterList&, Struct&)` names each member,
/// and from it come the flags, the tables of cell.toml, --help, the parameter page and the provenance.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "pipeline/contract/gel.h"
#include "pipeline/contract/range.h"
#include "pipeline/contract/words.h"

namespace mbtfm::stage {

/// A member of an enumeration with words: which of those allowed it is.
struct Choice {
  std::vector<std::string> words;
  std::function<std::size_t()> get;
  std::function<void(std::size_t)> set;
};

/// A number that is optional may stay unset; its meaning says what holds then.
using ParameterMember = std::variant<double*, std::optional<double>*, int*, std::optional<int>*, std::uint64_t*, bool*,
                                     std::string*, Choice>;

struct Parameter {
  std::string table;      ///< of cell.toml; empty: above the first table
  std::string name;       ///< key in the table
  std::string flag = {};  ///< without dashes: the name, or table.name where another table has a key of that name before
  ParameterMember member;
  Range range;
  std::string meaning;             ///< as help.txt has it, with the unit; empty: scenario files say it, --help does not
  std::string default_value = {};  ///< as printed
  bool is_required = false;
  bool is_set = false;
  bool is_derived = false;  ///< set from another parameter, which is the one that is given
};

class ParameterList {
 public:
  /// The following parameters belong to [name] of cell.toml.
  void table(std::string name) { table_ = std::move(name); }
  /// The same of a table in which another program has keys, too, and checks them.
  void table_of_several(std::string name) {
    tables_of_several_.insert(name);
    table_ = std::move(name);
  }
  bool is_of_several(const std::string& table) const { return tables_of_several_.contains(table); }
  /// @param member   a number, or an optional one
  /// @param meaning  if it is not as help.txt says
  template <class Number>
  void add(std::string name, Number& member, const Range& range, std::string meaning = {}) {
    add_member(std::move(name), &member, range, std::move(meaning));
  }
  void add(std::string name, std::uint64_t& seed, std::string meaning = {}) {
    add_member(std::move(name), &seed, Range::not_negative(), std::move(meaning));
  }
  void add(std::string name, bool& member, std::string meaning = {}) {
    add_member(std::move(name), &member, Range::any(), std::move(meaning));
  }
  void add(std::string name, std::string& member, std::string meaning = {}) {
    add_member(std::move(name), &member, Range::any(), std::move(meaning));
  }
  /// One of the words of its type, or of those `allowed`.
  template <Worded E>
  void add(std::string name, E& member, std::string meaning = {}, const std::vector<E>& allowed = values_of<E>());
  /// The same, or "auto" where it stays unset.
  template <Worded E>
  void add(std::string name, std::optional<E>& member, std::string meaning = {});
  /// The parameter added last has no default.
  void required() { parameters_.back().is_required = true; }

  /// What is derived once values have been read, whatever they were read from.
  void derive(std::function<void(ParameterList&)> derivation) { derivations_.push_back(std::move(derivation)); }
  void derive_all() {
    for (const auto& derivation : derivations_) derivation(*this);
  }

  std::vector<Parameter>& all() { return parameters_; }
  const std::vector<Parameter>& all() const { return parameters_; }

 private:
  void add_member(std::string name, ParameterMember member, const Range& range, std::string meaning);
  std::string table_;
  std::set<std::string> tables_of_several_;
  std::vector<std::function<void(ParameterList&)>> derivations_;
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
/// Parameters that are set, as a cell.toml, those of one table after another.
std::string to_toml(const ParameterList& list, const std::vector<std::string>& tables);
/// The parameter of this name. @throws UsageError that names the nearest one there is
Parameter& parameter_named(ParameterList& list, const std::string& name);
/// @throws UsageError where a required parameter was never set
void check_complete(const ParameterList& list);
/// The parameter page of this list: one table of name, default, range, meaning for each table of cell.toml.
std::string to_markdown(const ParameterList& list);

void declare(ParameterList& list, Gel& gel);

// --- implementation of the templates

template <class Member, class Value>
Choice choice_of(Member& member, std::vector<std::string> words, const std::vector<Value>& values) {
  return {
      .words = std::move(words),
      .get = [&member, values] { return static_cast<std::size_t>(std::ranges::find(values, member) - values.begin()); },
      .set = [&member, values](std::size_t k) { member = values.at(k); }};
}

template <Worded E>
void ParameterList::add(std::string name, E& member, std::string meaning, const std::vector<E>& allowed) {
  std::vector<std::string> words;
  for (const E value : allowed) words.emplace_back(name_of(value));
  add_member(std::move(name), choice_of(member, std::move(words), allowed), {}, std::move(meaning));
}

template <Worded E>
void ParameterList::add(std::string name, std::optional<E>& member, std::string meaning) {
  std::vector<std::string> words = {name_of(Switch::automatic)};
  std::vector<std::optional<E>> values = {std::nullopt};
  for (const E value : values_of<E>()) {
    words.emplace_back(name_of(value));
    values.emplace_back(value);
  }
  add_member(std::move(name), choice_of(member, std::move(words), values), {}, std::move(meaning));
}

}  // namespace mbtfm::stage
