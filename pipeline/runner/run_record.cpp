#include <nlohmann/json.hpp>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/runner/run_cell.h"

namespace mbtfm::runner {
namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

ordered_json stage_entry(const Stage& stage, const StageOutcome& outcome, const fs::path& cell) {
  const fs::path record_file = cell / stage.folder / "record.json";
  ordered_json entry;
  entry["state"] = outcome.was_run ? "run" : name_of(outcome.status.state);
  entry["why"] = outcome.status.why;
  entry["converged"] = outcome.converged;
  if (outcome.status.state == StageState::given || outcome.status.state == StageState::replaced) {
    entry["outputs"] = hash_files(cell, stage.writes);  // not ours: what they are is all that is known of them
    return entry;
  }
  if (fs::is_regular_file(record_file)) {
    const ordered_json record = ordered_json::parse(read_text(record_file));
    for (const auto& [key, value] : record.items()) {
      if (!entry.contains(key)) entry[key] = value;
    }
  }
  return entry;
}

}  // namespace

void write_run_record(const fs::path& cell, const RunOptions& options, const CellOutcome& outcome) {
  ordered_json run;
  run["program"] = "mbtfm";
  run["version"] = options.version;
  run["cell"] = fs::weakly_canonical(cell).filename().string();
  run["threads"] = options.threads;
  if (!options.preset.empty()) run["preset"] = options.preset;
  run["converged"] = outcome.converged();
  run["effects"] = ordered_json::array();
  for (std::size_t i = 0; i < stages().size(); ++i) {
    const Stage& stage = stages()[i];
    ordered_json entry = stage_entry(stage, outcome.stages[i], cell);
    if (entry.contains("effects")) {
      for (ordered_json effect : entry["effects"]) {
        effect["stage"] = stage.name;
        run["effects"].push_back(effect);
      }
    }
    run["stages"][stage.name] = std::move(entry);
  }
  const fs::path fit_file = cell / "4_fit/fit.json";
  if (fs::is_regular_file(fit_file)) {
    const ordered_json fit = ordered_json::parse(read_text(fit_file));
    if (fit.contains("error_budget")) run["error_budget"] = fit["error_budget"];
  }
  write_whole(cell / "run.json", run.dump(1) + "\n");
}

}  // namespace mbtfm::runner
