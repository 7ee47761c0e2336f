/// What the runner reads of a cell that it finds: record.json, fit.json, run.json, and the hashes it keeps.
#include "pipeline/contract/results.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/json_record.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/runner/run_record.h"
#include "pipeline/runner/stages.h"
#include "pipeline/runner/verify.h"
#include "tests/fuzz/target.h"

namespace mbtfm::fuzz::records_readers {
namespace {

std::vector<std::string> samples() {
  const std::string hash(64, 'a');
  put("whole.json", "");
  files::write_fit_summary(
      folder() / "whole.json",
      {.relative_l2 = 0.1,
       .noise_um = 0.02,
       .total_force_nN = 80,
       .converged = true,
       .error_budget =
           ErrorBudget{.tensions = {{.fibre_id = 1, .tension_nN = 3, .parts_nN = {.mesh = 0.1}}}, .total_force_nN = 80},
       .more = {{"loss", std::string("huber")}, {"n_beads", std::int64_t{200}}, {"is_lost", false}}});
  return {
      bytes_of(folder() / "whole.json"),
      R"({"stage": "fit", "figures": {"relative_l2": 0.1, "n": 3}, "summary": "two fibres", "outputs": [{"file": "fit.json"}],
 "effects": [{"name": "finite sides", "switch": "auto", "on": true, "number": 0.5, "why": "it matters", "seconds": 1}],
 "run": {"finished": true, "converged": true, "version": "0.1.0", "settings": {"gel": {"thickness_um": 60}},
  "inputs": {"3_network/network.vtu": ")" +
          hash + R"("}, "outputs": {"4_fit/fit.json": ")" + hash + R"("},
  "command": ["mbtfm-fit"], "seconds": 1.5, "peak_memory_MB": 30}})",
      R"({"version": "0.1.0", "outcome": "failed", "failure": {"stage": "fit", "how": "exit code 3", "message": "m"},
 "stages": {"fit": {"status": "run", "run": {"finished": true, "settings": {}, "inputs": {"a.csv": ")" +
          hash + R"("},
  "outputs": {"4_fit/fit.json": ")" +
          hash + R"("}}}}})",
      hash + " 20 1700000000000000000 1700000000000000000 65 1234 cell.toml\n" + hash + " 1 2 3 4 5 a b.csv\n"};
}

const std::string kToml = "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8\n";

/// A cell in which the input is the file of this name.
std::filesystem::path cell_with(const std::string& name, std::string_view input) {
  const std::string cell = "cell-with-" + std::filesystem::path(name).filename().string();
  if (!std::filesystem::exists(folder() / cell / "cell.toml")) put(cell + "/cell.toml", kToml);
  put(cell + "/" + name, input);
  return folder() / cell;
}

/// No stage was run.
runner::CellOutcome untouched() {
  runner::CellOutcome outcome;
  for (const runner::Stage& stage : runner::stages()) outcome.stages.emplace_back().stage = stage.name;
  return outcome;
}

void read(std::string_view bytes) {
  const std::string_view input = bytes;
  runner::RunOptions options;
  options.version = "0.1.0";

  const auto run = cell_with("run.json", input), recorded = cell_with("4_fit/record.json", input),
             fitted = cell_with("4_fit/fit.json", input), hashed = cell_with(".mbtfm.hashes", input);
  fuzz::answer([&] { runner::HashCache(hashed).hash({"cell.toml"}); });
  fuzz::answer([&] { runner::recorded_failure(run); });
  fuzz::answer([&] { runner::last_summary(recorded, {}); });
  fuzz::answer([&] { files::read_fit_summary(fitted / "4_fit/fit.json"); });

  // What goes through a whole cell is asked where the input is JSON at all: else it ends as those above, in JsonRecord.
  bool is_json = false;
  fuzz::answer([&] {
    files::JsonRecord(run / "run.json", "JSON");
    is_json = true;
  });
  if (!is_json) return;
  fuzz::answer([&] { runner::run_record_is_complete(run, options); });
  fuzz::answer([&] { runner::verify_cell(run); });
  fuzz::answer([&] { runner::write_run_record(recorded, options, runner::look_at_cell(recorded, options)); });
  fuzz::answer([&] {
    runner::BatchCell cell;
    cell.cell = recorded;
    runner::write_batch_tables(fuzz::folder(), {cell}, {}, {});
  });
  fuzz::answer([&] { runner::write_run_record(fitted, options, untouched()); });
}

const bool is_added = add({"records", 1500, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::records_readers
