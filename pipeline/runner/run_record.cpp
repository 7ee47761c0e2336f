#include "pipeline/runner/run_record.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/hash.h"
#include "pipeline/contract/json.h"
#include "pipeline/runner/lock.h"

namespace mbtfm::runner {
namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

constexpr const char* kNotRun = "not run";

/// null where there is none, or a damaged one: it is written anew.
ordered_json read_run_record(const fs::path& cell) {
  const fs::path file = cell / "run.json";
  if (!fs::is_regular_file(file)) return {};
  ordered_json run = ordered_json::parse(read_text(file), nullptr, /*allow_exceptions=*/false);
  return run.is_object() ? run : ordered_json{};
}

std::string state_of(const StageOutcome& outcome) {
  if (outcome.failure) return "failed";
  if (outcome.was_run) return name_of(StageState::must_run);
  return outcome.status.state == StageState::must_run ? kNotRun : name_of(outcome.status.state);
}

ordered_json stage_entry(const Stage& stage, const StageOutcome& outcome, const fs::path& cell,
                         const ordered_json& before) {
  ordered_json entry;
  entry["state"] = state_of(outcome);
  entry["why"] = outcome.status.why;
  entry["converged"] = outcome.converged;
  if (outcome.status.state == StageState::not_asked && before.is_object() && before.contains("state")) {
    for (const char* key : {"state", "why", "converged", "failure"}) {
      if (before.contains(key)) entry[key] = before[key];
    }
  }
  if (outcome.failure) {
    entry["failure"] = {{"exit_code", outcome.failure->exit_code},
                        {"how", outcome.failure->how},
                        {"message", outcome.failure->message}};
  }
  if (outcome.status.state == StageState::given || outcome.status.state == StageState::replaced) {
    Hashes outputs;  // not ours: what they are is all that is known of them
    for (const std::string& file : stage.writes) outputs[file] = sha256_of_file(cell / file);
    entry["outputs"] = outputs;
    return entry;
  }
  const fs::path record_file = cell / stage.folder / "record.json";
  if (fs::is_regular_file(record_file)) {
    const ordered_json record = ordered_json::parse(read_text(record_file));
    for (const auto& [key, value] : record.items()) {
      if (!entry.contains(key)) entry[key] = value;
    }
  }
  return entry;
}

/// The file that each key of [images] stands for.
ordered_json images_in(const fs::path& cell) {
  const ImageNames names = read_image_names(cell);
  ordered_json images = ordered_json::object();
  for (const Stage& stage : stages()) {
    for (const auto& inputs : {images_of(stage, names), stage.optional_images}) {
      for (const ImageInput& image : inputs) {
        const ImageMatch match = match_image(cell, name_of_image(names, image.key));
        if (match.files.size() == 1) images[image.key] = match.files[0].lexically_relative(cell).generic_string();
      }
    }
  }
  return images;
}

bool is_one_of(const ordered_json& entry, const std::vector<std::string>& states) {
  return entry.is_object() && std::find(states.begin(), states.end(), entry.value("state", "")) != states.end();
}

bool is_stage_done(const ordered_json& entry) {
  return is_one_of(entry, {name_of(StageState::must_run), name_of(StageState::up_to_date), name_of(StageState::given),
                           name_of(StageState::replaced)});
}

std::string outcome_of(const ordered_json& entries) {
  const auto has_failed = [](const ordered_json& entry) { return is_one_of(entry, {"failed"}); };
  if (std::any_of(entries.begin(), entries.end(), has_failed)) return "failed";
  return std::all_of(entries.begin(), entries.end(), is_stage_done) ? "done" : "unfinished";
}

}  // namespace

void write_run_record(const fs::path& cell, const RunOptions& options, const CellOutcome& outcome) {
  const RunRecordLock lock(cell);
  ordered_json before = read_run_record(cell);
  ordered_json run, entries;
  ordered_json effects = ordered_json::array();
  for (std::size_t i = 0; i < stages().size(); ++i) {
    const Stage& stage = stages()[i];
    entries[stage.name] = stage_entry(stage, outcome.stages[i], cell, before["stages"][stage.name]);
    for (ordered_json effect : entries[stage.name].value("effects", ordered_json::array())) {
      effect["stage"] = stage.name;
      effects.push_back(effect);
    }
  }
  run["program"] = "mbtfm";
  run["version"] = options.version;
  run["cell"] = fs::weakly_canonical(cell).filename().string();
  run["outcome"] = outcome_of(entries);
  run["threads"] = options.threads;
  if (!options.preset.empty()) run["preset"] = options.preset;
  run["converged"] = std::all_of(entries.begin(), entries.end(),
                                 [](const ordered_json& entry) { return entry.value("converged", true); });
  run["images"] = images_in(cell);
  run["effects"] = std::move(effects);
  run["stages"] = std::move(entries);
  const fs::path fit_file = cell / "4_fit/fit.json";
  if (fs::is_regular_file(fit_file)) {
    const ordered_json fit = ordered_json::parse(read_text(fit_file));
    if (fit.contains("error_budget")) run["error_budget"] = fit["error_budget"];
  }
  write_whole(cell / "run.json", json_text(run, 1) + "\n");
}

bool run_record_tells_of(const fs::path& cell, const RunOptions& options) {
  if (!fs::is_regular_file(cell / "run.json")) return false;
  // The line as we write it, outside of any string, as these hold no line breaks: spares parsing thousands of files.
  if (read_text(cell / "run.json").find("\n \"outcome\": \"done\",") != std::string::npos) return true;
  const ordered_json run = read_run_record(cell);
  if (!run.contains("stages")) return false;
  return std::all_of(stages().begin(), stages().end(), [&](const Stage& stage) {
    return !is_asked(stage, options.only) || is_stage_done(run["stages"].value(stage.name, ordered_json()));
  });
}

std::optional<RecordedFailure> recorded_failure(const fs::path& cell) {
  const ordered_json run = read_run_record(cell);
  if (!run.contains("stages")) return {};
  for (const auto& [stage, entry] : run["stages"].items()) {
    if (!entry.contains("failure")) continue;
    return RecordedFailure{
        .stage = stage, .how = entry["failure"].value("how", ""), .message = entry["failure"].value("message", "")};
  }
  return {};
}

}  // namespace mbtfm::runner
