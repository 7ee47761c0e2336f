/// Cells that are run in milliseconds: stages that are shell scripts, which put the files of a finished cell in place.
#pragma once

#include <nlohmann/json.hpp>

#include "pipeline/files/hash.h"
#include "pipeline/runner/stages.h"
#include "tests/support/fake_cell.h"
#include "tests/support/folders.h"

namespace mbtfm::test {

/// The record that a stage writes of the files in its folder, with one value of each kind that records have.
inline nlohmann::ordered_json record_of_folder(const fs::path& folder, const std::string& stage) {
  nlohmann::ordered_json outputs = nlohmann::ordered_json::array();
  for (const auto& entry : fs::directory_iterator(folder))
    outputs.push_back({{"file", entry.path().filename()}, {"sha256", files::sha256_of_file(entry.path())}});
  return {{"stage", stage},
          {"version", "1"},
          {"parameters", {{"pixel_size_um", 0.1}, {stage, {{"seed", 1}, {"is_fast", false}, {"method", "auto"}}}}},
          {"inputs", nlohmann::ordered_json::array()},
          {"outputs", outputs},
          {"threads", 1},
          {"seconds", 0.5},
          {"peak_memory_MB", 20.5},
          {"converged", true},
          {"summary", "made by a script"},
          {"figures", {{"n", 3}, {"share", 0.25}, {"is_good", true}, {"why", "so"}}},
          {"effects",
           {{{"name", "robust loss"},
             {"switch", "auto"},
             {"on", false},
             {"number", 0.1},
             {"threshold", 0.5},
             {"why", "no tails"},
             {"seconds", 0.1},
             {"change", 0.01},
             {"would_change", "would change little"}}}}};
}

/// @param seed  of the invented tensions
/// @returns the folder of the stages, FOLDER/bin
inline fs::path make_script_stages(const fs::path& folder, unsigned seed = 1) {
  const fs::path made = folder / "made", bin = folder / "bin";
  write_given_stages(made, round_cell());
  write_invented_fit(made, seed);
  FitSummary fit = files::read_fit_summary(made / "4_fit/fit.json");
  const ErrorParts parts{.beads = 0.1, .segmentation = 0.2, .mesh = 0.1, .substrate = 0.01, .solver = 0, .model = 0.1};
  fit.error_budget = ErrorBudget{.tensions = {{0, 0.06, parts}, {1, 2, parts}, {2, 3, parts}},
                                 .total_force_nN = fit.total_force_nN,
                                 .total_force_parts_nN = parts};
  files::write_fit_summary(made / "4_fit/fit.json", fit, round_cell().fibres);
  fs::create_directories(bin);
  for (const runner::Stage& stage : runner::stages()) {
    files::write_text(made / stage.folder / "record.json", record_of_folder(made / stage.folder, stage.name).dump());
    files::write_text(bin / ("mbtfm-" + stage.name),
                      files::read_text(test::source_folder() / "tests/data/copying_stage.sh"));
    fs::permissions(bin / ("mbtfm-" + stage.name), fs::perms::owner_all);
  }
  return bin;
}

/// cell.toml and images, which the scripts do not look at.
inline void make_unfinished_cell(const fs::path& cell) {
  fs::create_directories(cell);
  files::write_text(cell / "cell.toml", "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\n");
  for (const char* image : {"paxillin.tif", "actin.tif", "beads_stressed.tif", "beads_relaxed.tif"})
    files::write_text(cell / image, image);
}

}  // namespace mbtfm::test
