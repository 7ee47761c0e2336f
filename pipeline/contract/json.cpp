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

}  // namespace mbtfm
