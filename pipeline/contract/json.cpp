#include "pipeline/contract/json.h"

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

}  // namespace mbtfm
