#include "pipeline/runner/run_record.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/json.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/toml.h"
#include "pipeline/numerics/machine.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/lock.h"
#include "pipeline/runner/record.h"
#include "pipeline/runner/run_cell.h"

namespace mbtfm::runner {
using nlohmann::ordered_json;

namespace {

constexpr const char *kNotRun = "not run", *kFailed = "failed";  // beside the words of StageState

/// None where there is none: a link, which the next one replaces, is none of ours.
std::optional<files::JsonRecord> open_run_record(const fs::path& cell) {
  const fs::path file = cell / "run.json";
  if (!files::is_own_file(file)) return std::nullopt;
  return files::JsonRecord(file, "a run.json of mbtfm run", "delete it: the next run writes another");
}

/// What an earlier run recorded of a stage; none if it recorded nothing.
std::optional<files::JsonRecord> entry_of(const std::optional<files::JsonRecord>& run, const std::string& stage) {
  const auto entries = run ? run->find("stages") : std::nullopt;
  const auto entry = entries ? entries->find(stage) : std::nullopt;
  if (entry) entry->expect_object();
  return entry;
}

std::string state_of(const StageOutcome& outcome) {
  if (outcome.failure) return kFailed;
  if (outcome.was_run) return name_of(StageState::must_run);
  return outcome.status.state == StageState::must_run ? kNotRun : name_of(outcome.status.state);
}

ordered_json json_of(const StageFailure& failure) {
  return {{"exit_code", failure.exit_code}, {"how", failure.how}, {"message", failure.message}};
}

std::optional<StageFailure> failure_in(const files::JsonRecord& entry) {
  const auto failure = entry.find("failure");
  if (!failure) return std::nullopt;
  return StageFailure{.exit_code = failure->at("exit_code").integer(),
                      .how = failure->text_or("how", ""),
                      .message = failure->text_or("message", "")};
}

/// Of a stage that is not asked for: what was given or changed by hand is so without a run of that stage.
StageOutcome completed(StageOutcome outcome, const Stage& stage, const fs::path& cell) {
  if (outcome.status.state != StageState::not_asked) return outcome;
  const std::optional<StageRecord> record = read_record(cell, stage);
  HashCache hashes(cell);
  if (const auto by_hand = changed_by_hand(stage, record, outputs_now(stage, record, hashes)))
    outcome.status = *by_hand;
  return outcome;
}

ordered_json stage_entry(const Stage& stage, const StageOutcome& recorded, const fs::path& cell,
                         const std::optional<files::JsonRecord>& before) {
  const StageOutcome outcome = completed(recorded, stage, cell);
  ordered_json entry;
  entry["state"] = state_of(outcome);
  entry["why"] = outcome.status.why;
  entry["converged"] = outcome.converged;
  if (outcome.status.state == StageState::not_asked && before && before->find("state")) {
    entry["state"] = before->at("state").text();
    entry["why"] = before->text_or("why", "");
    entry["converged"] = before->is_true_or("converged", true);
    if (const auto failure = failure_in(*before)) entry["failure"] = json_of(*failure);
  }
  if (outcome.failure) entry["failure"] = json_of(*outcome.failure);
  if (outcome.status.state == StageState::given || outcome.status.state == StageState::replaced) {
    Hashes outputs;  // not ours: what they are is all that is known of them
    for (const std::string& file : stage.writes) outputs[file] = files::sha256_of_file(cell / file);
    entry["outputs"] = outputs;
    return entry;
  }
  const fs::path record_file = record_file_of(cell, stage);
  if (!files::is_own_file(record_file)) return entry;
  const files::JsonRecord record(record_file, "a record of mbtfm run", "delete it to run the stage again");
  for (const auto& [key, value] : record.members())
    if (!entry.contains(key)) entry[key] = value.json();
  if (const auto effects = record.find("effects"))
    for (const files::JsonRecord& effect : effects->list()) effect.expect_object();
  files::findings_of(record);  // are such
  return entry;
}

/// The file that each key of [images] names.
ordered_json images_in(const fs::path& cell) {
  const ImageNames names = read_image_names(cell);
  ordered_json images = ordered_json::object();
  for (const Stage& stage : stages_of(cell, names).stages) {
    for (const auto& inputs : {images_of(stage, names), stage.optional_images}) {
      for (const ImageInput& image : inputs) {
        const ImageMatch match = match_image(cell, name_of_image(names, image.key));
        if (match.files.size() == 1) images[image.key] = match.files[0].lexically_relative(cell).generic_string();
      }
    }
  }
  return images;
}

bool is_done_state(const std::string& state) {
  const auto is = [&](StageState s) { return state == name_of(s); };
  return is(StageState::must_run) || is(StageState::up_to_date) || is(StageState::given) || is(StageState::replaced);
}

/// Of entries that stage_entry made.
bool is_done_entry(const ordered_json& entry) { return is_done_state(entry.at("state")); }

RunOutcome outcome_of(const ordered_json& entries) {
  const auto has_failed = [](const ordered_json& entry) { return entry.at("state") == kFailed; };
  if (std::any_of(entries.begin(), entries.end(), has_failed)) return RunOutcome::failed;
  const bool is_done = std::all_of(entries.begin(), entries.end(), is_done_entry);
  return is_done ? RunOutcome::done : RunOutcome::unfinished;
}

}  // namespace

void write_run_record(const fs::path& cell, const RunOptions& options, const CellOutcome& outcome) {
  const RunRecordLock lock(cell);
  const std::optional<files::JsonRecord> before = open_run_record(cell);
  const CellStages of = stages_of(cell, read_image_names(cell));
  ordered_json run, entries;
  ordered_json effects = ordered_json::array(), findings = ordered_json::array();
  const auto gather = [](ordered_json& all, const ordered_json& entry, const char* key, const std::string& stage) {
    for (ordered_json one : entry.value(key, ordered_json::array())) {
      one["stage"] = stage;
      all.push_back(std::move(one));
    }
  };
  for (std::size_t i = 0; i < of.stages.size(); ++i) {
    const Stage& stage = of.stages[i];
    entries[stage.name] = stage_entry(stage, outcome.stages.at(i), cell, entry_of(before, stage.name));
    gather(effects, entries[stage.name], "effects", stage.name);
    gather(findings, entries[stage.name], "findings", stage.name);
  }
  run["program"] = "mbtfm";
  run["version"] = options.version;
  run["cell"] = fs::weakly_canonical(cell).filename().string();
  run["kind"] = name_of(of.kind);
  if (!of.why.empty()) run["kind_because"] = of.why;
  if (is_sheet(of.kind)) {
    const RunSettings settings = read_run_settings(cell);
    run["run"] = {{"model", name_of(settings.model)}, {"bundles", settings.bundles}};
  }
  if (const files::SharedSettings shared = files::shared_settings(cell / "cell.toml"); !shared.file.empty())
    run["study"] = {{"file", fs::proximate(shared.file, fs::weakly_canonical(cell)).generic_string()},
                    {"sha256", files::sha256_of_file(shared.file)},
                    {"keys", shared.keys}};
  run["outcome"] = name_of(outcome_of(entries));
  run["started"] = outcome.started;
  if (!outcome.ended.empty()) run["ended"] = outcome.ended;
  run["processor"] = numerics::processor_name();
  run["threads"] = options.threads;
  if (!options.preset.empty()) run["preset"] = options.preset;
  run["converged"] =
      std::all_of(entries.begin(), entries.end(), [](const ordered_json& entry) { return entry.at("converged"); });
  run["images"] = images_in(cell);
  run["effects"] = std::move(effects);
  run["findings"] = std::move(findings);
  // Of a fit that has not ended in this run, the old file may be what is to be replaced.
  const bool has_fit = is_done_entry(entries[of.stages.back().name]);
  run["stages"] = std::move(entries);
  const fs::path fit_file = cell / "4_fit/fit.json";
  if (has_fibres(of.kind) && has_fit && files::is_own_file(fit_file)) {
    const files::JsonRecord fit(fit_file, "a fit summary as mbtfm-fit writes it", "delete it to run the fit again");
    if (const auto budget = fit.find("error_budget")) run["error_budget"] = budget->json();
  }
  files::write_whole(cell / "run.json", files::json_text(run, 1) + "\n");
}

bool run_record_is_complete(const fs::path& cell, const RunOptions& options) {
  const fs::path file = cell / "run.json";
  if (!files::is_own_file(file)) return false;
  // The line as we write it, outside of any string, as these hold no line breaks: spares parsing thousands of files.
  if (files::is_own_text(file) && files::read_text(file).find("\n \"outcome\": \"done\",") != std::string::npos)
    return true;
  const std::optional<files::JsonRecord> run = open_run_record(cell);
  return std::ranges::all_of(stages_of(cell, read_image_names(cell)).stages, [&](const Stage& stage) {
    const auto entry = entry_of(run, stage.name);
    return !is_asked(stage, options.only) || (entry && is_done_state(entry->text_or("state", "")));
  });
}

std::string recorded_state(const fs::path& cell, const std::string& stage) {
  const auto entry = entry_of(open_run_record(cell), stage);
  return entry ? entry->text_or("state", "") : "";
}

std::optional<RecordedFailure> recorded_failure(const fs::path& cell) {
  const std::optional<files::JsonRecord> run = open_run_record(cell);
  for (const Stage& stage : all_stages()) {
    const auto entry = entry_of(run, stage.name);
    const auto failure = entry ? failure_in(*entry) : std::nullopt;
    if (failure) return RecordedFailure{.stage = stage.name, .how = failure->how, .message = failure->message};
  }
  return {};
}

}  // namespace mbtfm::runner
