#include "pipeline/files/json.h"

#include <nlohmann/json.hpp>

#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/listed.h"
#include "pipeline/files/names.h"

namespace mbtfm::files {

nlohmann::ordered_json json_of(const Value& value) {
  return std::visit([](const auto& v) { return nlohmann::ordered_json(v); }, value);
}

nlohmann::ordered_json json_of(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

nlohmann::ordered_json json_of(const Figures& figures) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [name, value] : figures) json[name] = json_of(value);
  return json;
}

nlohmann::ordered_json json_of(const Effect& e) {
  nlohmann::ordered_json json = {{"name", name_of(e.kind)}, {"switch", name_of(e.setting)}, {"on", e.is_on}};
  if (e.number) json["number"] = *e.number;
  if (e.threshold) json["threshold"] = *e.threshold;
  json["why"] = e.why;
  json["seconds"] = e.seconds;
  if (e.change) json["change"] = *e.change;
  if (!e.would_change.empty()) json["would_change"] = e.would_change;
  return json;
}

namespace {

std::optional<double> number_in(const JsonRecord& record, const char* key) {
  const auto member = record.find(key);
  return member ? std::optional(member->number()) : std::nullopt;
}

template <Worded E>
E value_of(const JsonRecord& record) {
  const std::optional<E> value = named<E>(record.text());
  if (value) return *value;
  record.fail("one of " + listed(words(E{})));
}

}  // namespace

Effect effect_of(const JsonRecord& record) {
  return {.kind = value_of<EffectKind>(record.at("name")),
          .setting = value_of<Switch>(record.at("switch")),
          .is_on = record.at("on").is_true(),
          .number = number_in(record, "number"),
          .threshold = number_in(record, "threshold"),
          .why = record.at("why").text(),
          .seconds = record.at("seconds").number(),
          .change = number_in(record, "change"),
          .would_change = record.text_or("would_change", "")};
}

nlohmann::ordered_json json_of(const Finding& f) {
  nlohmann::ordered_json json = {{"id", f.id}, {"severity", name_of(f.severity)}, {"text", f.text}};
  if (f.number) json["number"] = *f.number;
  if (f.threshold) json["threshold"] = *f.threshold;
  json["number_is"] = f.number_is;
  json["reason"] = f.reason;
  json["remedy"] = f.remedy;
  return json;
}

Finding finding_of(const JsonRecord& record) {
  return {.id = present_id(record.at("id").text()),
          .severity = value_of<Severity>(record.at("severity")),
          .text = record.at("text").text(),
          .number = number_in(record, "number"),
          .threshold = number_in(record, "threshold"),
          .number_is = record.text_or("number_is", ""),
          .reason = record.text_or("reason", ""),
          .remedy = record.text_or("remedy", "")};
}

std::vector<Finding> findings_of(const JsonRecord& record) {
  std::vector<Finding> findings;
  if (const auto list = record.find("findings"))
    for (const JsonRecord& finding : list->list()) findings.push_back(finding_of(finding));
  return findings;
}

namespace {

nlohmann::ordered_json in_utf8(const nlohmann::ordered_json& json) {
  if (json.is_string()) return shown_name(json.get_ref<const std::string&>());
  if (!json.is_structured()) return json;
  nlohmann::ordered_json escaped = json.is_array() ? nlohmann::ordered_json::array() : nlohmann::ordered_json::object();
  for (const auto& [key, value] : json.items())
    if (json.is_array())
      escaped.push_back(in_utf8(value));
    else
      escaped[shown_name(key)] = in_utf8(value);
  return escaped;
}

}  // namespace

std::string json_text(const nlohmann::ordered_json& json, int indent) { return in_utf8(json).dump(indent); }

std::string events_of(const std::string& stage, const StageReport& report) {
  std::string lines;
  const auto add = [&](const char* kind, const nlohmann::ordered_json& content) {
    nlohmann::ordered_json event = {{"event", kind}, {"stage", stage}};
    event.update(content);
    lines += json_text(event) + "\n";
  };
  for (const Finding& finding : report.findings) add("finding", json_of(finding));
  for (const Effect& effect : report.effects) add("effect", json_of(effect));
  return lines;
}

}  // namespace mbtfm::files
