#include "pipeline/report/provenance.h"

#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/files/json.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
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
    if (value.is_object())
      flatten(value, name, pairs);
    else
      pairs.emplace_back(name, text_of(value));
  }
}

Pairs flat(const std::optional<files::JsonRecord>& record, const char* key) {
  Pairs pairs;
  const auto member = record ? record->find(key) : std::nullopt;
  if (!member) return pairs;
  member->expect_object();
  flatten(member->json(), {}, pairs);
  return pairs;
}

std::string number_of(const std::optional<files::JsonRecord>& record, const char* key) {
  const auto member = record ? record->find(key) : std::nullopt;
  return member ? readable(member->number()) : std::string();
}

StageLine stage_of(const std::string& name, const files::JsonRecord& record) {
  const auto run = record.find("run");
  return {.name = name,
          .state = record.at("state").text(),
          .why = record.at("why").text(),
          .version = record.text_or("version", ""),
          .summary = record.text_or("summary", ""),
          .seconds = number_of(run, "seconds"),
          .peak_memory_MB = number_of(run, "peak_memory_MB"),
          .converged = record.is_true_or("converged", true),
          .parameters = flat(record, "parameters"),
          .figures = flat(record, "figures"),
          .inputs = flat(run, "inputs")};
}

EffectLine effect_line_of(const files::JsonRecord& record) {
  return {.name = record.at("name").text(),
          .stage = record.text_or("stage", ""),
          .why = record.text_or("why", ""),
          .seconds = record.number_or("seconds", 0) > 0 ? number_of(record, "seconds") : "",
          .is_on = record.at("on").is_true()};
}

}  // namespace

std::string program_of(const Provenance& provenance) {
  return "mbtfm" + (provenance.version.empty() ? "" : " " + provenance.version);
}

Provenance read_provenance(const std::filesystem::path& run_file) {
  Provenance provenance;
  if (!files::is_own_file(run_file)) return provenance;
  const files::JsonRecord run(run_file, "a run.json as mbtfm run writes it",
                              "delete it; if that does not help, the record.json of the stage, too");
  provenance.version = run.at("version").text();
  const std::string kind = run.text_or("kind", name_of(provenance.kind));
  if (!named<CellKind>(kind))
    throw InputError(run_file.string(), "a kind of cell: plane, space or sheet", "'" + kind + "'",
                     "delete it and run mbtfm run again");
  provenance.kind = *named<CellKind>(kind);
  provenance.kind_because = run.text_or("kind_because", "");
  provenance.started = run.text_or("started", "");
  provenance.ended = run.text_or("ended", "");
  provenance.processor = run.text_or("processor", "");
  provenance.preset = run.text_or("preset", "");
  if (const auto accuracy = run.find("accuracy")) {
    provenance.accuracy =
        WantedAccuracy{.verdict = accuracy->at("verdict").text(), .is_met = accuracy->at("met").is_true()};
  }
  for (const auto& [name, stage] : run.at("stages").members()) provenance.stages.push_back(stage_of(name, stage));
  for (const files::JsonRecord& effect : run.at("effects").list()) provenance.effects.push_back(effect_line_of(effect));
  provenance.findings = files::findings_of(run);
  return provenance;
}

}  // namespace mbtfm::report
