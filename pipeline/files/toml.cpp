#define TOML_IMPLEMENTATION  // compiled here, not taken from the system's library, which was built as toml++ has it
#include "pipeline/files/toml.h"

#include <algorithm>
#include <array>

#include "pipeline/contract/errors.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"

namespace mbtfm::files {

namespace {

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte < 0x20 && c != '\t' && c != '\n' && c != '\r') || byte == 0x7F;
}

/// TOML is UTF-8 without control characters. @throws InputError
void expect_text(std::string_view text, const std::string& name) {
  int line = 1;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t n = utf8_length(rest);
    if (n == 0 || is_control(rest.front())) {
      throw InputError(name + ":" + std::to_string(line), "TOML, a text in UTF-8",
                       (n == 0 ? "the byte " : "the control character ") + byte_shown(rest.front()),
                       "save the file as plain text in UTF-8");
    }
    if (rest.front() == '\n') ++line;
    rest.remove_prefix(n);
  }
}

/// toml++ bounds how deep values nest, but not how many parts a dotted key has: each is a table, and tables are taken
/// down one in the other. A key of some ten thousand parts overflows the stack.
void expect_shallow_keys(std::string_view text, const std::string& name) {
  constexpr std::ptrdiff_t kMostDots = 1000;  // on a line of ours: some; of tables in a stack of 8 MB: ten thousands
  int number = 1;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (std::ranges::count(line, '.') > kMostDots) {
      throw InputError(name + ":" + std::to_string(number),
                       "TOML with at most " + std::to_string(kMostDots) + " dots on a line", "more",
                       "the file may be damaged");
    }
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    ++number;
  }
}

/// What a line was probably meant to say; empty: no idea.
std::string advice_on(std::string_view text, std::size_t line) {
  for (std::size_t i = 1; i < line && text.find('\n') != text.npos; ++i) text.remove_prefix(text.find('\n') + 1);
  const std::string_view here = text.substr(0, text.find('\n'));
  if (text.starts_with("{\\rtf")) return "save the file as plain text, not as rich text";
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const std::size_t equals = here.find('='), colon = here.find(':'), first = here.find_first_not_of(" \t");
  if (first != here.npos && std::string_view("/;%!*").find(here[first]) != std::string_view::npos)
    return "a comment begins with #";
  if (equals == here.npos && first != here.npos && here[first] == '[')
    return here.find(']') == here.npos
               ? "a table's name stands between brackets: " + std::string(here.substr(first)) + "]"
               : "each table stands once: put all its keys below the first";
  if (equals != here.npos && here.find_first_not_of(" \t\r", equals + 1) == here.npos)
    return "a value follows the equals sign, or take the line out";
  if (equals == here.npos && colon != here.npos)
    return "an equals sign stands between key and value: pixel_size_um = 0.1";
  if (const auto comma = here.find(','); comma != here.npos && comma > 0 && comma + 1 < here.size() &&
                                         is_digit(here[comma - 1]) && is_digit(here[comma + 1]))
    return "decimals follow a point: 8.4";
  if (here.find("“") != here.npos || here.find("”") != here.npos || here.find("„") != here.npos)
    return "texts stand between straight quotes: \"actin.tif\"";
  if (const auto value = here.find_first_not_of(" \t", std::min(here.find('='), here.size() - 1) + 1);
      here.find('=') != here.npos && value != here.npos && is_digit(here[value]) &&
      here.find_first_of("\"'") == here.npos) {
    const std::string_view number = here.substr(value, here.find_first_not_of("0123456789.+-eE", value) - value);
    if (number.ends_with('.')) return "a digit follows the point: " + std::string(number) + "0";
    return "the number alone, without a unit: " + std::string(number);
  }
  if (equals != here.npos)
    if (const auto value = here.find_first_not_of(" \t", equals + 1);
        value != here.npos && here[value] == '.' && value + 1 < here.size() && is_digit(here[value + 1]))
      return "a digit goes before the point: 0" +
             std::string(here.substr(value, here.find_first_of(" \t#\r", value) - value));
  if (here.find('\\') != here.npos)
    return "write folders with /, as in \"D:/images/cell 1\", or the text in single quotes";
  if (here.find('=') != here.npos && here.find('"') == here.npos && here.find('\'') == here.npos)
    return "a text needs quotes: actin = \"actin.tif\"";
  return {};
}

}  // namespace

toml::table parse_toml(std::string_view text, const std::string& name) {
  expect_text(text, name);
  expect_shallow_keys(text, name);
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    throw InputError(name + ":" + std::to_string(error.source().begin.line), "TOML", std::string(error.description()),
                     advice_on(text, error.source().begin.line));
  } catch (const ImpossibleToml&) {
    throw InputError(name, "TOML", "brackets, quotes or keys that make none");
  }
}

namespace {

/// A cell that gives one of them does not take the other: each says the gel's stiffness.
constexpr std::array kEither = {"youngs_modulus_kPa", "shear_modulus_kPa"};

bool is_said(const toml::table& own, std::string_view key) {
  if (own.contains(key)) return true;
  return std::ranges::find(kEither, key) != kEither.end() &&
         std::ranges::any_of(kEither, [&](const char* other) { return own.contains(other); });
}

/// Nodes are moved: each still knows the file and the line that it is from.
/// @returns the keys that came
std::vector<std::string> complete(toml::table& own, toml::table&& shared, const std::string& of = {}) {
  std::vector<std::string> keys;
  for (auto&& [key, node] : shared) {
    const std::string name = of + std::string(key.str());
    toml::table *table = node.as_table(), *known = own[key.str()].as_table();
    if (table && known) {
      for (std::string& inner : complete(*known, std::move(*table), name + ".")) keys.push_back(std::move(inner));
    } else if (!is_said(own, key.str())) {
      if (table)
        for (const auto& [inner, value] : *table) keys.push_back(name + "." + std::string(inner.str()));
      else
        keys.push_back(name);
      node.visit([&, &at = key](auto& value) { own.insert(at, std::move(value)); });
    }
  }
  return keys;
}

constexpr const char *kOfCell = "cell.toml", *kOfStudy = "study.toml";

std::filesystem::path study_above(const std::filesystem::path& cell_toml) {
  if (cell_toml.filename() != kOfCell) return {};
  std::error_code error;
  std::filesystem::path folder = std::filesystem::weakly_canonical(cell_toml, error).parent_path();
  while (!error && folder.has_relative_path()) {
    folder = folder.parent_path();
    if (is_file(folder / kOfStudy)) return folder / kOfStudy;
  }
  return {};
}

toml::table parse_file(const std::filesystem::path& file) { return parse_toml(read_text(file), file.string()); }

}  // namespace

toml::table parse_toml(const std::filesystem::path& file) {
  toml::table own = parse_file(file);
  if (const auto study = study_above(file); !study.empty()) complete(own, parse_file(study));
  return own;
}

SharedSettings shared_settings(const std::filesystem::path& cell_toml) {
  const std::filesystem::path file = study_above(cell_toml);
  if (file.empty()) return {};
  toml::table own = parse_file(cell_toml);
  return {.file = file, .keys = complete(own, parse_file(file))};
}

}  // namespace mbtfm::files
