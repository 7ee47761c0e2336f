#include "pipeline/contract/json.h"

#include "pipeline/contract/names.h"

namespace mbtfm {

nlohmann::ordered_json json_of(const Value& value) {
  return std::visit([](const auto& v) { return nlohmann::ordered_json(v); }, value);
}

nlohmann::ordered_json json_of(const Figures& figures) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [name, value] : figures) json[name] = json_of(value);
  return json;
}

nlohmann::ordered_json json_of(const Effect& e) {
  nlohmann::ordered_json json = {{"name", e.name}, {"switch", e.setting}, {"on", e.is_on}};
  if (e.number) json["number"] = *e.number;
  if (e.threshold) json["threshold"] = *e.threshold;
  json["why"] = e.why;
  json["seconds"] = e.seconds;
  if (e.change) json["change"] = *e.change;
  if (!e.would_change.empty()) json["would_change"] = e.would_change;
  return json;
}

Effect effect_of(const JsonRecord& record) {
  const auto number = [&](const char* key) -> std::optional<double> {
    const auto member = record.find(key);
    return member ? std::optional(member->number()) : std::nullopt;
  };
  return {.name = record.at("name").text(),
          .setting = record.at("switch").text(),
          .is_on = record.at("on").is_true(),
          .number = number("number"),
          .threshold = number("threshold"),
          .why = record.at("why").text(),
          .seconds = record.at("seconds").number(),
          .change = number("change"),
          .would_change = record.text_or("would_change", "")};
}

namespace {

nlohmann::ordered_json in_utf8(const nlohmann::ordered_json& json) {
  if (json.is_string()) return shown_name(json.get_ref<const std::string&>());
  if (!json.is_structured()) return json;
  nlohmann::ordered_json escaped = json.is_array() ? nlohmann::ordered_json::array() : nlohmann::ordered_json::object();
  for (const auto& [key, value] : json.items()) {
    if (json.is_array()) {
      escaped.push_back(in_utf8(value));
    } else {
      escaped[shown_name(key)] = in_utf8(value);
    }
  }
  return escaped;
}

}  // namespace

std::string json_text(const nlohmann::ordered_json& json, int indent) { return in_utf8(json).dump(indent); }

}  // namespace mbtfm
