#include "pipeline/files/json_record.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"

namespace mbtfm::files {
namespace {

using Json = JsonRecord::Json;

// Ours nest six deep. Deeper ones are refused before they are taken apart: most of what is done with a JSON value calls
// itself once a level.
constexpr int kDeepest = 32;
Json parse(const std::string& text) {
  const Json::parser_callback_t watch = [](int depth, Json::parse_event_t, Json&) {
    if (depth > kDeepest) throw InvalidData("", "", "more than " + std::to_string(kDeepest) + " levels");
    return true;
  };
  return Json::parse(text, watch);
}

/// What a message repeats of a file that may be anyone's: a short piece of plain characters.
std::string shown(std::string text) {
  constexpr std::size_t kLongest = 80;
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "...";
}

std::string kind_of(const Json& value) {
  if (value.is_null()) return "null";
  if (value.is_object()) return "an object";
  if (value.is_array()) return "a list of " + std::to_string(value.size());
  return shown(value.dump());
}

}  // namespace

struct JsonRecord::File {
  std::string name, kind, hint;
  Json json = {};
};

JsonRecord::JsonRecord(const std::filesystem::path& file, std::string kind, std::string hint) {
  File whole{.name = file.string(), .kind = std::move(kind), .hint = std::move(hint)};
  const auto refuse = [&](const std::string& found) { throw InputError(whole.name, whole.kind, found, whole.hint); };
  std::error_code error;
  if (std::filesystem::file_size(file, error) > kLargestText_bytes && !error) refuse("a file of more than 256 MB");
  try {
    whole.json = parse(read_text(file));
  } catch (const InvalidData& deep) {
    refuse(deep.found);
  } catch (const Json::exception& exception) {
    refuse(shown(exception.what()));
  }
  file_ = std::make_shared<const File>(std::move(whole));
  value_ = &file_->json;
  expect_object();
}

std::string JsonRecord::place() const { return place_.empty() ? file_->kind : "'" + place_ + "' of " + file_->kind; }

void JsonRecord::fail(const std::string& expected) const {
  throw InputError(file_->name, place() + " to be " + expected, kind_of(*value_), file_->hint);
}

void JsonRecord::expect_object() const {
  if (!value_->is_object()) fail("an object");
}

JsonRecord JsonRecord::child(const std::string& key, const Json& value) const {
  return {file_, value, place_.empty() ? shown(key) : place_ + "." + shown(key)};
}

JsonRecord JsonRecord::at(const std::string& key) const {
  expect_object();
  const auto found = value_->find(key);
  if (found == value_->end()) throw InputError(file_->name, "'" + key + "' in " + place(), "none", file_->hint);
  return child(key, *found);
}

std::optional<JsonRecord> JsonRecord::find(const std::string& key) const {
  expect_object();
  const auto found = value_->find(key);
  if (found == value_->end() || found->is_null()) return std::nullopt;
  return child(key, *found);
}

std::vector<std::pair<std::string, JsonRecord>> JsonRecord::members() const {
  expect_object();
  std::vector<std::pair<std::string, JsonRecord>> list;
  for (const auto& [key, value] : value_->items()) list.emplace_back(key, child(key, value));
  return list;
}

std::vector<JsonRecord> JsonRecord::list() const {
  if (!value_->is_array()) fail("a list");
  std::vector<JsonRecord> list;
  for (const Json& value : *value_) list.push_back(child(std::to_string(list.size()), value));
  return list;
}

std::string JsonRecord::text() const {
  if (!value_->is_string()) fail("a text");
  return value_->get<std::string>();
}

bool JsonRecord::is_true() const {
  if (!value_->is_boolean()) fail("true or false");
  return value_->get<bool>();
}

double JsonRecord::number() const {
  if (!value_->is_number()) fail("a number");
  return value_->get<double>();
}

int JsonRecord::integer() const {
  using Limits = std::numeric_limits<int>;
  if (!value_->is_number_integer()) fail("a whole number");
  const double value = value_->get<double>();  // exact in the range of int
  if (value < Limits::min() || value > Limits::max()) fail("a whole number of up to ten digits");
  return static_cast<int>(value);
}

Value JsonRecord::figure() const {
  if (value_->is_boolean()) return value_->get<bool>();
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  const bool is_too_large = value_->is_number_unsigned() && value_->get<std::uint64_t>() > kMost;
  if (value_->is_number_integer() && !is_too_large) return value_->get<std::int64_t>();
  if (value_->is_number()) return value_->get<double>();
  const auto all = [&](bool (Json::*is)() const noexcept) {
    return value_->is_array() && std::all_of(value_->begin(), value_->end(), [&](const Json& v) { return (v.*is)(); });
  };
  if (all(&Json::is_number_integer)) return value_->get<std::vector<std::int64_t>>();
  if (all(&Json::is_string)) return value_->get<std::vector<std::string>>();
  if (!value_->is_string()) fail("a number, a text, true or false, or a list of whole numbers or of texts");
  return value_->get<std::string>();
}

std::string JsonRecord::text_or(const std::string& key, const std::string& otherwise) const {
  const auto member = find(key);
  return member ? member->text() : otherwise;
}

bool JsonRecord::is_true_or(const std::string& key, bool otherwise) const {
  const auto member = find(key);
  return member ? member->is_true() : otherwise;
}

double JsonRecord::number_or(const std::string& key, double otherwise) const {
  const auto member = find(key);
  return member ? member->number() : otherwise;
}

}  // namespace mbtfm::files
