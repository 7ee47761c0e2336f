/// What is known of how a stage's outputs came about, and whether they still hold.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/runner/images.h"
#include "pipeline/runner/settings.h"
#include "pipeline/runner/stages.h"

namespace mbtfm::runner {

/// SHA-256 by path relative to the cell folder.
using Hashes = std::map<std::string, std::string>;
/// A file that does not exist is left out.
Hashes hash_files(const std::filesystem::path& cell, const std::vector<std::string>& names);

/// The runner's part of a stage's record.json.
struct StageRecord {
  bool finished = false;  ///< false: begun, and never ended by itself
  bool converged = true;
  std::string version;   ///< of the program
  std::string settings;  ///< the tables of cell.toml that the stage depends on, as JSON
  Hashes inputs;
  Hashes outputs;
};

/// Empty where the file is not there. @throws InputError where it is malformed
std::optional<StageRecord> read_record(const std::filesystem::path& record_file);
/// Before a stage begins: from now on its outputs may be a mixture of two runs.
void write_begun(const std::filesystem::path& record_file, const Stage& stage);
/// Take the mark back, and the folder with it where nothing else is in it.
void forget_begun(const std::filesystem::path& record_file);
/// The record is still the one of write_begun.
bool is_begun(const std::filesystem::path& record_file);
/// Add the runner's part to the record that the stage wrote (or to none).
void complete_record(const std::filesystem::path& record_file, const StageRecord& record, double seconds,
                     double peak_memory_MB);

/// The tables of cell.toml that `stage` depends on, as JSON with sorted keys. @throws InputError
/// @param beneath  values that stand in place of defaults
std::string settings_of(const Stage& stage, const std::filesystem::path& toml_file,
                        const std::vector<Setting>& beneath = {});

/// Paths, relative to the cell folder, of the files that a stage reads: its images as far as they are there, and the
/// files of earlier stages.
std::vector<std::string> inputs_of(const Stage& stage, const std::filesystem::path& cell, const ImageNames& images);

enum class StageState {
  up_to_date,  ///< this version made the outputs from these inputs and settings
  given,       ///< the user put the outputs there
  replaced,    ///< the user changed outputs of ours: they are kept
  not_asked,   ///< left out by --only
  must_run
};
struct StageStatus {
  StageState state = StageState::must_run;
  std::string why;
};
std::string name_of(StageState state);

/// What the stage would be run with now.
struct StageSurroundings {
  std::string version, settings;
  Hashes inputs, outputs;
  bool has_images = true;  ///< one at least of those that it must have
};
StageSurroundings surroundings_of(const Stage& stage, const std::filesystem::path& cell, const ImageNames& images,
                                  const std::vector<Setting>& beneath, const std::string& version);

/// @throws InputError where some of the outputs were given and others lack
StageStatus status_of(const Stage& stage, const std::optional<StageRecord>& record, const StageSurroundings& now);

}  // namespace mbtfm::runner
