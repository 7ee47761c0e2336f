#include "pipeline/report/provenance.h"

#include <nlohmann/json.hpp>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/report/numbers.h"

namespace mbtfm::report {
namespace {

using nlohmann::ordered_json;
using Pairs = std::vector<std::pair<std::string, std::string>>;

std::string text_of(const ordered_json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_null()) return "not set";
  if (value.is_number_float()) return readable(value.get<double>());
  return value.dump();
}

/// Every value, named by its way through the objects: gel.thickness_um.
void flatten(const ordered_json& json, const std::string& prefix, Pairs& pairs) {
  for (const auto& [key, value] : json.items()) {
    const std::string name = prefix.empty() ? key : prefix + "." + key;
    if (value.is_object()) {
      flatten(value, name, pairs);
    } else {
      pairs.emplace_back(name, text_of(value));
    }
  }
}

Pairs flat(const ordered_json& json, const char* key) {
  Pairs pairs;
  if (json.contains(key)) flatten(json.at(key), {}, pairs);
  return pairs;
}

std::string number_of(const ordered_json& json, const char* key) {
  return json.contains(key) && json.at(key).is_number() ? readable(json.at(key).get<double>()) : std::string();
}

StageLine stage_of(const std::string& name, const ordered_json& json) {
  const ordered_json run = json.value("run", ordered_json::object());
  return {.name = name,
          .state = json.at("state"),
          .why = json.at("why"),
          .version = json.value("version", ""),
          .summary = json.value("summary", ""),
          .seconds = number_of(run, "seconds"),
          .peak_memory_MB = number_of(run, "peak_memory_MB"),
          .converged = json.value("converged", true),
          .parameters = flat(json, "parameters"),
          .figures = flat(json, "figures"),
          .inputs = flat(run, "inputs")};
}

}  // namespace

Provenance read_provenance(const std::filesystem::path& run_file) {
  Provenance provenance;
  if (!std::filesystem::is_regular_file(run_file)) return provenance;
  try {
    const ordered_json run = ordered_json::parse(read_text(run_file));
    provenance.version = run.at("version");
    provenance.preset = run.value("preset", "");
    if (run.contains("accuracy")) {
      const ordered_json& accuracy = run.at("accuracy");
      provenance.accuracy = WantedAccuracy{.verdict = accuracy.at("verdict"), .is_met = accuracy.at("met")};
    }
    for (const auto& [name, stage] : run.at("stages").items()) provenance.stages.push_back(stage_of(name, stage));
    for (const ordered_json& effect : run.at("effects")) {
      provenance.effects.push_back({.name = effect.at("name"),
                                    .stage = effect.value("stage", ""),
                                    .why = effect.value("why", ""),
                                    .seconds = effect.value("seconds", 0.0) > 0 ? number_of(effect, "seconds") : "",
                                    .is_on = effect.at("on")});
    }
  } catch (const ordered_json::exception& error) {
    throw InputError(run_file.string(), "a run.json as mbtfm run writes it", error.what());
  }
  return provenance;
}

}  // namespace mbtfm::report
