#include "pipeline/runner/record.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ranges>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/json.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/text.h"
#include "pipeline/files/toml.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::runner {
using nlohmann::json;

namespace {

/// A stage's record as it and mbtfm wrote it; none where it is not there.
std::optional<files::JsonRecord> open_record(const fs::path& file) {
  if (!files::is_own_file(file)) return std::nullopt;
  return files::JsonRecord(file, "a record of mbtfm run", "delete it to run the stage again");
}

Hashes hashes_of(const files::JsonRecord& run, const std::string& key) {
  Hashes hashes;
  const auto list = run.find(key);
  if (!list) return hashes;
  for (const auto& [name, hash] : list->members()) hashes[name] = hash.text();
  return hashes;
}

struct Difference {
  std::string name, what;
};

std::vector<Difference> differences(const Hashes& before, const Hashes& now) {
  std::vector<Difference> result;
  for (const auto& [name, hash] : now) {
    const auto found = before.find(name);
    if (found == before.end()) result.push_back({name, " is new"});
    if (found != before.end() && found->second != hash) result.push_back({name, " has changed"});
  }
  for (const auto& [name, hash] : before)
    if (!now.contains(name)) result.push_back({name, " is gone"});
  return result;
}

bool is_of_frames(const std::string& file) {
  const auto is_of_whole = [&](const Stage& stage) {
    return std::ranges::find(stage.reads_where_there, file) != stage.reads_where_there.end();
  };
  return std::ranges::none_of(stages(), is_of_whole) &&
         std::ranges::any_of(stages(), [&](const Stage& stage) { return is_of_series(stage, file); });
}

/// Nothing differs but, maybe, files that an earlier stage wrote of single frames.
bool are_of_series(const std::vector<Difference>& differences) {
  return std::ranges::all_of(differences, [](const Difference& difference) { return is_of_frames(difference.name); });
}

/// Those of a time series that the tracker wrote, one for each frame that it did not refuse.
std::vector<std::string> frames_read(const fs::path& cell, const std::string& list) {
  std::vector<std::string> names;
  for (const files::FrameRow& frame : files::read(cell / list, files::frame_table())) {
    if (!frame.refused.empty()) continue;
    const fs::path file = fs::path(list).parent_path() / files::displacement_of_frame(frame.frame);
    names.push_back(file.generic_string());
  }
  return names;
}

}  // namespace

fs::path record_file_of(const fs::path& cell, const Stage& stage) { return cell / stage.folder / "record.json"; }

fs::path output_file(const fs::path& cell, const Stage& stage, const fs::path& name, const std::string& named_by) {
  const fs::path file = files::inside(cell, name, named_by);
  if (!name.empty() && *name.begin() == stage.folder) return file;
  throw InputError(named_by, "outputs of " + stage.name + " in " + stage.folder, "'" + name.string() + "'",
                   "remove the file if it is not yours");
}

std::optional<StageRecord> read_record(const fs::path& cell, const Stage& stage) {
  const fs::path file = record_file_of(cell, stage);
  const std::optional<files::JsonRecord> whole = open_record(file);
  if (!whole) return {};
  StageRecord record;
  const auto run = whole->find("run");
  if (!run) return record;
  record.finished = run->at("finished").is_true();
  record.converged = run->is_true_or("converged", true);
  record.version = run->text_or("version", "");
  const auto settings = run->find("settings");
  record.settings = settings ? settings->json().dump() : "{}";
  record.inputs = hashes_of(*run, "inputs");
  record.outputs = hashes_of(*run, "outputs");
  for (const auto& [name, hash] : record.outputs) output_file(cell, stage, name, file.string());
  return record;
}

std::optional<StageReport> report_of(const fs::path& cell, const Stage& stage) {
  const fs::path file = record_file_of(cell, stage);
  if (!files::is_own_file(file)) return std::nullopt;
  try {
    return stage::read_report(file);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void write_begun(const fs::path& record_file, const Stage& stage, const std::string& record_before) {
  fs::create_directories(record_file.parent_path());
  nlohmann::ordered_json begun = {{"stage", stage.name}};
  if (!record_before.empty()) begun = nlohmann::ordered_json::parse(record_before);
  begun["run"] = {{"finished", false}};
  files::write_whole(record_file, files::json_text(begun, 1) + "\n");
}

std::vector<std::string> series_outputs(const fs::path& cell, const Stage& stage) {
  std::vector<std::string> names;
  const std::optional<files::JsonRecord> record = open_record(record_file_of(cell, stage));
  const auto outputs = record ? record->find("outputs") : std::nullopt;
  if (!outputs) return names;
  for (const files::JsonRecord& output : outputs->list()) {
    const std::string name = (fs::path(stage.folder) / output.at("file").text()).generic_string();
    if (is_of_series(stage, name)) names.push_back(name);
  }
  return names;
}

void forget_begun(const fs::path& record_file) {
  std::error_code is_not_empty;
  fs::remove(record_file);
  fs::remove(record_file.parent_path(), is_not_empty);
}

bool is_begun(const fs::path& record_file) {
  const std::optional<files::JsonRecord> record = open_record(record_file);
  return record && record->find("run");
}

void complete_record(const fs::path& record_file, const StageRecord& record, const StageRun& run) {
  const std::optional<files::JsonRecord> of_stage = open_record(record_file);
  if (!of_stage) throw InputError(record_file.string(), "the record that the stage wrote", "none");
  nlohmann::ordered_json whole = of_stage->json();
  whole["run"] = {{"finished", record.finished},
                  {"converged", record.converged},
                  {"version", record.version},
                  {"settings", json::parse(record.settings)},
                  {"inputs", record.inputs},
                  {"outputs", record.outputs},
                  {"command", run.command},
                  {"seconds", run.seconds},
                  {"peak_memory_MB", run.peak_memory_MB}};
  files::write_whole(record_file, files::json_text(whole, 1) + "\n");
}

Settings read_settings(const fs::path& toml_file, const std::vector<Stage>& stages,
                       const std::vector<Setting>& beneath) {
  const toml::table whole = files::parse_toml(toml_file);
  Settings settings;
  for (const Stage& stage : stages) {
    toml::table relevant;
    for (const auto& [key, value] : whole) {
      const std::string table = value.is_table() ? std::string(key.str()) : std::string();
      if (std::find(stage.tables.begin(), stage.tables.end(), table) != stage.tables.end()) relevant.insert(key, value);
    }
    toml::table effects;
    if (const toml::table* all = whole["effects"].as_table()) {
      for (const auto& [key, value] : *all)
        if (std::ranges::find(stage.effects, key.str()) != stage.effects.end()) effects.insert(key, value);
    }
    if (!effects.empty()) relevant.insert("effects", effects);
    std::ostringstream text;
    text << toml::json_formatter(relevant);
    json values = json::parse(text.str());
    const auto set = [&](const Setting& setting) {
      if (std::find(stage.tables.begin(), stage.tables.end(), setting.table) == stage.tables.end()) return;
      json& table = values[setting.table];
      if (!table.is_null() && !table.is_object())
        throw InputError(toml_file.string(), "a table [" + setting.table + "]", table.dump());
      table[setting.key] = setting.value;
    };
    std::ranges::for_each(beneath, set);
    std::ranges::for_each(stage.settings, set);
    settings[stage.name] = values.dump();
  }
  return settings;
}

namespace {

std::vector<std::string> files_of(const std::vector<ImageInput>& inputs, const fs::path& cell,
                                  const ImageNames& images) {
  std::vector<std::string> names;
  for (const ImageInput& image : inputs) {
    const ImageMatch match = match_image(cell, name_of_image(images, image.key));
    for (const fs::path& file : match.files) {
      const std::string name = file.lexically_relative(cell).generic_string();
      if (!files::is_folder(file)) names.push_back(name);
      if (const fs::path half = other_half(name); !half.empty()) names.push_back(half.generic_string());
      if (files::is_folder(file))  // of frames
        for (const fs::path& frame : files::visible_in(file))
          if (files::is_file(frame)) names.push_back(name + "/" + frame.filename().string());
    }
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace

std::vector<std::string> inputs_of(const Stage& stage, const fs::path& cell, const ImageNames& images) {
  std::vector<std::string> names = files_of(images_of(stage, images), cell, images);
  for (std::string& name : files_of(stage.optional_images, cell, images)) names.push_back(std::move(name));
  names.insert(names.end(), stage.reads.begin(), stage.reads.end());
  std::ranges::copy_if(stage.reads_where_there, std::back_inserter(names),
                       [&](const std::string& file) { return files::is_own_file(cell / file); });
  for (const PathArgument& argument : stage.arguments) {
    if (argument.given != PathArgument::Given::if_series || !files::is_own_file(cell / *argument.condition())) continue;
    names.push_back(*argument.condition());
    for (std::string& name : frames_read(cell, *argument.condition())) names.push_back(std::move(name));
  }
  return names;
}

Hashes outputs_now(const Stage& stage, const std::optional<StageRecord>& record, HashCache& hashes) {
  std::vector<std::string> outputs = stage.writes;
  if (record) {
    for (const auto& [name, hash] : record->outputs)
      if (std::find(outputs.begin(), outputs.end(), name) == outputs.end()) outputs.push_back(name);
  }
  return hashes.hash(outputs);
}

StageSurroundings surroundings_of(const Stage& stage, const CellNow& now, const std::optional<StageRecord>& record) {
  return {.version = now.version,
          .settings = now.settings.at(stage.name),
          .inputs = now.hashes.hash(inputs_of(stage, now.cell, now.images)),
          .outputs = outputs_now(stage, record, now.hashes),
          .has_images = !files_of(images_of(stage, now.images), now.cell, now.images).empty()};
}

std::optional<StageStatus> changed_by_hand(const Stage& stage, const std::optional<StageRecord>& record,
                                           const Hashes& outputs) {
  const auto is_there = [&](const std::string& name) { return outputs.contains(name); };
  if (!std::ranges::all_of(stage.writes, is_there)) return {};
  if (!record) return StageStatus{StageState::given, "its outputs were there before the first run"};
  if (!record->finished ||
      !std::ranges::all_of(record->outputs, [&](const auto& output) { return is_there(output.first); }))
    return {};
  for (const auto& [name, hash] : outputs) {
    const auto ours = record->outputs.find(name);
    if (ours == record->outputs.end() || ours->second != hash)
      return StageStatus{StageState::replaced, name + " was changed by hand: kept"};
  }
  return {};
}

StageStatus status_of(const Stage& stage, const std::optional<StageRecord>& record, const StageSurroundings& now) {
  if (const auto by_hand = changed_by_hand(stage, record, now.outputs)) return *by_hand;
  std::vector<std::string> missing;
  for (const std::string& name : stage.writes)
    if (!now.outputs.contains(name)) missing.push_back(name);
  if (!record) {
    if (missing.size() == stage.writes.size()) return {StageState::must_run, "not run yet"};
    throw InputError(stage.folder, "all outputs of the stage, or none", "no " + missing.front(),
                     "add the missing files, or remove the others and let mbtfm make them");
  }
  if (!record->finished) return {StageState::must_run, "was begun and not finished"};
  if (!missing.empty()) return {StageState::must_run, missing.front() + " is gone"};
  const std::vector<Difference> of_inputs = differences(record->inputs, now.inputs);
  const bool is_same = record->version == now.version && record->settings == now.settings;
  const bool keeps_frames = stage.keeps_frames && is_same && are_of_series(of_inputs);
  for (const auto& [name, hash] : record->outputs)
    if (!now.outputs.contains(name)) return {StageState::must_run, name + " is gone", keeps_frames};
  if (!stage.images.empty() && !now.has_images) return {StageState::given, "its images are gone: outputs kept"};
  if (record->version != now.version) return {StageState::must_run, "was made by version " + record->version};
  if (record->settings != now.settings) return {StageState::must_run, "its parameters have changed"};
  if (!of_inputs.empty()) return {StageState::must_run, of_inputs.front().name + of_inputs.front().what, keeps_frames};
  return {StageState::up_to_date, "same version, parameters and inputs"};
}

}  // namespace mbtfm::runner
