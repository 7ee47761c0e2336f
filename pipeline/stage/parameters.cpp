#include "pipeline/stage/parameters.h"

#include <array>
#include <cmath>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/toml.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/suggest.h"

namespace mbtfm::stage {

namespace {

/// The tables of cell.toml. Each stage reads its own and leaves the others' keys to them.
constexpr std::array kTables = {"gel",       "images", "segment", "track",    "network", "cables",   "effects",
                                "substrate", "fit",    "stats",   "scenario", "space",   "traction", "surface",
                                "checks",    "cell",   "indent",  "mean",     "sheet",   "plan",     "run"};
/// Keys of [gel] that not every program has.
const std::vector<std::string> kMoreOfGel = {"radius_um"};
/// What people put elsewhere: not every program has them.
constexpr std::array kKeysOfGel = {"youngs_modulus_kPa", "shear_modulus_kPa", "poisson_ratio", "thickness_um",
                                   "radius_um"};
/// The keys above the first table.
constexpr std::array kRootKeys = {"pixel_size_um"};

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

template <class T>
T number_in(const std::optional<T>&);
template <class T>
T number_in(const T&);
/// The type of a number that may be optional.
template <class Member>
using NumberIn = decltype(number_in(std::declval<Member>()));

std::string in_table(const Parameter& p) { return (p.table.empty() ? "" : "[" + p.table + "] ") + p.name; }

/// What a value must be: "a number > 0", "true or false", "one of a, b".
std::string expectation(const Parameter& p) {
  return std::visit(
      Overloaded{[&](auto* number) {
                   constexpr bool kIsReal = std::is_floating_point_v<NumberIn<decltype(*number)>>;
                   return describe(kIsReal ? "a number" : "an integer", p.range);
                 },
                 [](bool*) { return std::string("true or false"); }, [](std::string*) { return std::string("a text"); },
                 [](const Choice& choice) { return "one of " + listed(choice.words); }},
      p.member);
}

/// Set the member; false where the text is not what it must be.
bool try_set(Parameter& p, const std::string& text) {
  return std::visit(
      Overloaded{[&](auto* number) {
                   const auto value = parsed<NumberIn<decltype(*number)>>(text);
                   if (!value || !std::isfinite(*value) || !is_inside(p.range, static_cast<double>(*value)))
                     return false;
                   *number = *value;
                   return true;
                 },
                 [&](bool* member) {
                   *member = text == "true";
                   return *member || text == "false";
                 },
                 [&](std::string* member) {
                   *member = text;
                   return true;
                 },
                 [&](const Choice& choice) {
                   const auto word = std::ranges::find(choice.words, text);
                   if (word == choice.words.end()) return false;
                   choice.set(static_cast<std::size_t>(word - choice.words.begin()));
                   return true;
                 }},
      p.member);
}

/// What was probably meant: another unit, or a word of which less than half is misspelt.
std::string likely_slip(const Parameter& p, const std::string& text) {
  if (const auto* choice = std::get_if<Choice>(&p.member)) return did_you_mean(choice->words, text);
  if (const auto value = parsed<double>(text)) return unit_slip(p.name, *value, p.range);
  const std::size_t digits = text.find_first_not_of("0123456789.+-");
  if (digits != text.npos && digits > 0 && text[digits] != ',' && parsed<double>(text.substr(0, digits)))
    return "the number alone, without a unit: " + text.substr(0, digits);
  std::string with_point = text;
  std::ranges::replace(with_point, ',', '.');
  return with_point != text && parsed<double>(with_point) ? "decimals follow a point: " + with_point : "";
}

std::string advice_on(const Parameter& p, const std::string& text) {
  const std::string slip = likely_slip(p, text);
  if (slip.empty() || p.meaning.empty()) return slip + p.meaning;
  return slip + " (" + p.meaning + ")";
}

/// In the file that the node is from: of a cell.toml some are from study.toml.
std::string place(const std::string& name, const toml::node& node) {
  return (node.source().path ? *node.source().path : name) + ":" + std::to_string(node.source().begin.line);
}

/// The texts of an array with commas between them.
std::string joined(const toml::array& list, const std::string& where) {
  std::string text;
  for (const toml::node& element : list) {
    const auto* name = element.as_string();
    if (!name)
      throw InputError(where, "a number, a text, true or false", "an array of other things than texts",
                       "one value, without brackets");
    text += (text.empty() ? "" : ",") + name->get();
  }
  return text;
}

/// The value as a flag would spell it.
std::string spelled(const toml::node& node, const std::string& where) {
  if (const auto* v = node.as_floating_point()) return shortest(v->get());
  if (const auto* v = node.as_integer()) return std::to_string(v->get());
  if (const auto* v = node.as_boolean()) return v->get() ? "true" : "false";
  if (const auto* v = node.as_string()) return v->get();
  if (const auto* list = node.as_array()) return joined(*list, where);
  throw InputError(where, "a number, a text, true or false", "a date or a nested table");
}

/// @param list  of the stage, whose keys of other tables may be meant
std::string unknown_key_hint(const ParameterList& list, const std::vector<std::string>& known, const std::string& key) {
  if ((" " + help_on("deleted keys", "") + " ").find(" " + key + " ") != std::string::npos)
    return "this version computes as its default did and has no such key: take the line out (CHANGELOG.md)";
  if (const std::string meant = did_you_mean(known, key); !meant.empty()) return meant;
  if (std::ranges::find(kKeysOfGel, key) != kKeysOfGel.end()) return "it belongs under [gel]";
  if (std::ranges::find(kRootKeys, key) != kRootKeys.end()) return "it belongs above the first table";
  for (const Parameter& p : list.all())
    if (p.name == key)
      return p.table.empty() ? "it belongs above the first table" : "it belongs under [" + p.table + "]";
  if (const std::string meant = did_you_mean(effect_keys(), key); !meant.empty()) return meant + " It is in [effects]";
  return known.empty() ? "docs/parameters.md has all keys" : "there are " + listed(known);
}

}  // namespace

void ParameterList::add_member(std::string name, ParameterMember member, const Range& range, std::string meaning) {
  if (meaning.empty()) meaning = help_on(table_.empty() ? "cell.toml" : table_, name);
  Parameter parameter{.table = table_,
                      .name = std::move(name),
                      .member = std::move(member),
                      .range = range,
                      .meaning = std::move(meaning)};
  parameter.default_value = to_text(parameter);
  const auto is_namesake = [&](const Parameter& other) { return other.name == parameter.name; };
  parameter.flag = std::ranges::any_of(parameters_, is_namesake) ? table_ + "." + parameter.name : parameter.name;
  for (const Parameter& other : parameters_) MBTFM_ASSERT(other.flag != parameter.flag);
  parameters_.push_back(std::move(parameter));
}

namespace {

void read_table(ParameterList& list, const toml::table& root, const std::string& name) {
  std::map<std::string, std::vector<std::string>> keys_of;  // by table, of this list
  for (const Parameter& p : list.all()) keys_of[p.table].push_back(p.name);

  const auto set = [&](const std::string& table, std::string_view key, const toml::node& node) {
    for (Parameter& p : list.all()) {
      if (p.table != table || p.name != key) continue;
      const std::string where = place(name, node) + ": " + in_table(p);
      const std::string value = spelled(node, where);
      if (!try_set(p, value)) throw InputError(where, expectation(p), "'" + value + "'", advice_on(p, value));
      p.is_set = true;
      return true;
    }
    return false;
  };
  for (const auto& [key, node] : root) {
    const std::string key_name(key.str());
    if (const toml::table* table = node.as_table()) {
      if (keys_of.contains(key_name)) {
        for (const auto& [inner_key, inner] : *table) {
          if (set(key_name, inner_key.str(), inner) || list.is_of_several(key_name)) continue;
          const std::vector<std::string> others = key_name == "effects" ? effect_keys() : std::vector<std::string>();
          const std::vector<std::string>& of_other_stages = key_name == "gel" ? kMoreOfGel : others;
          if (std::ranges::find(of_other_stages, std::string(inner_key.str())) != of_other_stages.end()) continue;
          throw InputError(
              place(name, inner), "a known key of [" + key_name + "]", "'" + std::string(inner_key.str()) + "'",
              unknown_key_hint(list, others.empty() ? keys_of[key_name] : others, std::string(inner_key.str())));
        }
      } else if (std::find(kTables.begin(), kTables.end(), key_name) == kTables.end()) {
        throw InputError(place(name, node), "a known table", "[" + key_name + "]",
                         unknown_key_hint(list, {kTables.begin(), kTables.end()}, key_name));
      }
    } else if (!set("", key_name, node) && std::find(kRootKeys.begin(), kRootKeys.end(), key_name) == kRootKeys.end()) {
      std::vector<std::string> known(kRootKeys.begin(), kRootKeys.end());
      throw InputError(place(name, node), "a known key above the first table", "'" + key_name + "'",
                       unknown_key_hint(list, known, key_name));
    }
  }
  list.derive_all();
}

}  // namespace

void read_toml(ParameterList& list, const std::filesystem::path& file) {
  read_table(list, files::parse_toml(file), file.string());
}

void read_toml(ParameterList& list, std::string_view text, const std::string& name) {
  read_table(list, files::parse_toml(text, name), name);
}

void set_from_text(Parameter& p, const std::string& text) {
  if (!try_set(p, text)) {
    const std::string slip = likely_slip(p, text);
    throw UsageError("--" + p.flag + ": expected " + expectation(p) + ", found '" + text + "'" +
                     (slip.empty() ? "" : "; " + slip));
  }
  p.is_set = true;
}

std::string to_text(const Parameter& p) {
  return std::visit(Overloaded{[](auto* number) { return files::field_of(*number, 0); },
                               [](bool* member) { return std::string(*member ? "true" : "false"); },
                               [](const Choice& choice) { return choice.words.at(choice.get()); }},
                    p.member);
}

std::string to_toml(const ParameterList& list, const std::vector<std::string>& tables) {
  std::string text;
  for (const std::string& table : tables) {
    if (!table.empty()) text += "\n[" + table + "]\n";
    for (const Parameter& p : list.all()) {
      if (p.table != table || to_text(p).empty() || p.is_derived) continue;  // not set
      const bool is_text = std::holds_alternative<std::string*>(p.member) || std::holds_alternative<Choice>(p.member);
      text += p.name + " = " + (is_text ? '"' + to_text(p) + '"' : to_text(p)) + "\n";
    }
  }
  return text;
}

Parameter& parameter_named(ParameterList& list, const std::string& name) {
  std::vector<std::string> known;
  for (Parameter& p : list.all()) {
    if (p.flag == name) return p;
    known.push_back(p.flag);
  }
  throw UsageError("no parameter is called '" + name + "': " + did_you_mean(known, name));
}

void check_complete(const ParameterList& list) {
  for (const Parameter& p : list.all())
    if (p.is_required && !p.is_set)
      throw UsageError(in_table(p) + " is missing: give it in cell.toml or as --" + p.flag + " (" + p.meaning + ")");
}

std::string to_markdown(const ParameterList& list) {
  std::string text;
  std::string table = "\n";  // no table is called so
  for (const Parameter& p : list.all()) {
    if (p.meaning.empty()) continue;
    if (p.table != table) {
      table = p.table;
      text += "\n### " + (table.empty() ? "Above the first table" : "`[" + table + "]`") + "\n\n";
      text += "| key | default | value | meaning |\n|---|---|---|---|\n";
    }
    const std::string value = p.is_required ? "required" : p.default_value.empty() ? "" : "`" + p.default_value + "`";
    text += "| `" + p.name + "` | " + value + " | " + expectation(p) + " | " + p.meaning + " |\n";
  }
  return text;
}

namespace {

/// E = 2 (1 + nu) G of an isotropic gel.
void derive_youngs_modulus(ParameterList& list, Gel& gel) {
  const auto of_gel = [&](const char* name) -> Parameter& {
    return *std::ranges::find_if(list.all(), [&](const Parameter& p) { return p.table == "gel" && p.name == name; });
  };
  Parameter& modulus = of_gel("youngs_modulus_kPa");
  if (!gel.shear_modulus_kPa) return;
  if (modulus.is_set && !modulus.is_derived)
    throw UsageError(
        "[gel] youngs_modulus_kPa and shear_modulus_kPa are given: expected one of them, as E = 2 (1 + nu) G");
  gel.youngs_modulus_kPa = 2 * (1 + gel.poisson_ratio) * *gel.shear_modulus_kPa;
  modulus.is_set = modulus.is_derived = true;
}

}  // namespace

void declare(ParameterList& list, Gel& gel) {
  list.table("gel");
  list.add("youngs_modulus_kPa", gel.youngs_modulus_kPa, Range::modulus_kPa());
  list.required();
  list.add("shear_modulus_kPa", gel.shear_modulus_kPa, Range::modulus_kPa());
  list.derive([&gel](ParameterList& of) { derive_youngs_modulus(of, gel); });
  list.add("poisson_ratio", gel.poisson_ratio, Range::between(0, 0.5));
  list.add("thickness_um", gel.thickness_um, Range::thickness_um());
  list.add("youngs_modulus_sigma_kPa", gel.youngs_modulus_sigma_kPa, Range{.low = 0});
  list.add("poisson_ratio_sigma", gel.poisson_ratio_sigma, Range{.low = 0, .high = 0.5});
  list.add("thickness_sigma_um", gel.thickness_sigma_um, Range{.low = 0});
}

}  // namespace mbtfm::stage
