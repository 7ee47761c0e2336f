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

Value value_of(const nlohmann::ordered_json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_number_integer()) return json.get<std::int64_t>();
  if (json.is_number()) return json.get<double>();
  return json.get<std::string>();
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

Effect effect_of(const nlohmann::ordered_json& json) {
  const auto number = [&](const char* key) -> std::optional<double> {
    return json.contains(key) ? std::optional<double>(json.at(key).get<double>()) : std::nullopt;
  };
  return {.name = json.at("name"),
          .setting = json.at("switch"),
          .is_on = json.at("on"),
          .number = number("number"),
          .threshold = number("threshold"),
          .why = json.at("why"),
          .seconds = json.at("seconds"),
          .change = number("change"),
          .would_change = json.value("would_change", "")};
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
