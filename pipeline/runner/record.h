/// What is known of how a stage's outputs came about, and whether they still hold.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/stage_report.h"
#include "pipeline/contract/stage_state.h"
#include "pipeline/runner/hash_cache.h"
#include "pipeline/runner/images.h"
#include "pipeline/runner/stages.h"

namespace mbtfm::runner {

/// The runner's part of a stage's record.json.
struct StageRecord {
  bool finished = false;  ///< false: begun, and never ended by itself
  bool converged = true;
  std::string version;   ///< of the program
  std::string settings;  ///< the tables of cell.toml that the stage depends on, as JSON
  Hashes inputs;
  Hashes outputs;
};

std::filesystem::path record_file_of(const std::filesystem::path& cell, const Stage& stage);

/// Where an output lies that a record names, relative to the cell folder. Outputs are hashed, copied and deleted by
/// what records say. @param named_by  the record @throws InputError where it does not lie inside of the stage's own
/// folder
std::filesystem::path output_file(const std::filesystem::path& cell, const Stage& stage,
                                  const std::filesystem::path& name, const std::string& named_by);

/// Empty where there is none. @throws InputError where it is malformed, or names outputs outside of the stage's folder
std::optional<StageRecord> read_record(const std::filesystem::path& cell, const Stage& stage);
/// What the stage reported when it ran last; none if there is no record, or a damaged one: the run reports that.
std::optional<StageReport> report_of(const std::filesystem::path& cell, const Stage& stage);
/// Before a stage begins: from now on its outputs may be a mixture of two runs.
/// @param record_before  of a stage that keeps frames of the run before: what that run said of them stays; else empty
void write_begun(const std::filesystem::path& record_file, const Stage& stage, const std::string& record_before = {});
/// Take the mark back, and the folder with it where nothing else is in it.
void forget_begun(const std::filesystem::path& record_file);
/// The record is still the one of write_begun.
bool is_begun(const std::filesystem::path& record_file);
/// The files of a time series, relative to the cell folder, that the stage's record has among its outputs.
std::vector<std::string> series_outputs(const std::filesystem::path& cell, const Stage& stage);

/// What a stage took, and how it was started.
struct StageRun {
  std::vector<std::string> command;  ///< paths relative to the cell folder
  double seconds = 0;
  double peak_memory_MB = 0;
};
/// Add the runner's part to the record that the stage wrote.
void complete_record(const std::filesystem::path& record_file, const StageRecord& record, const StageRun& run);

/// By stage, the tables of cell.toml that it depends on, as JSON with sorted keys.
using Settings = std::map<std::string, std::string>;
/// @param stages   of the cell; settings of their own replace what cell.toml says
/// @param beneath  values that replace defaults
/// @throws InputError
Settings read_settings(const std::filesystem::path& toml_file, const std::vector<Stage>& stages,
                       const std::vector<Setting>& beneath = {});

/// Paths, relative to the cell folder, of the files that a stage reads: its images as far as they are there, and the
/// files of earlier stages.
std::vector<std::string> inputs_of(const Stage& stage, const std::filesystem::path& cell, const ImageNames& images);

struct StageStatus {
  StageState state = StageState::must_run;
  std::string why;
  bool keeps_frames = false;  ///< must run for single frames of a time series alone: the others still hold
};

/// A cell as it is now.
struct CellNow {
  const std::filesystem::path& cell;
  const ImageNames& images;
  const Settings& settings;
  HashCache& hashes;
  std::string version;  ///< of the program
};

/// What the stage would be run with now.
struct StageSurroundings {
  std::string version, settings;
  Hashes inputs, outputs;
  bool has_images = true;  ///< one at least of those that it must have
};
StageSurroundings surroundings_of(const Stage& stage, const CellNow& now, const std::optional<StageRecord>& record);

/// Given or replaced where outputs of a stage that is not asked for were put there or changed by hand; else none.
std::optional<StageStatus> changed_by_hand(const Stage& stage, const std::optional<StageRecord>& record,
                                           const Hashes& outputs);
/// The stage's outputs that are there: what it always writes, and what its record names.
Hashes outputs_now(const Stage& stage, const std::optional<StageRecord>& record, HashCache& hashes);

/// @throws InputError where some of the outputs were given and others lack
StageStatus status_of(const Stage& stage, const std::optional<StageRecord>& record, const StageSurroundings& now);

}  // namespace mbtfm::runner
