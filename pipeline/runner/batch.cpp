#include "pipeline/runner/batch.h"

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <mutex>
#include <sstream>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/process.h"

namespace mbtfm::runner {
namespace fs = std::filesystem;
namespace {

void collect_cells(const fs::path& folder, std::vector<fs::path>& cells) {
  if (fs::is_regular_file(folder / "cell.toml")) {
    cells.push_back(folder);
    return;
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory() && !entry.is_symlink()) collect_cells(entry.path(), cells);
  }
}

/// The first line of a log that tells of an error: it is the cause of those after it; or else its last line.
std::string first_error(const fs::path& log_file) {
  std::ifstream log(log_file);
  std::string last;
  for (std::string line; std::getline(log, line);) {
    if (line.find(": error: ") != std::string::npos) return line;
    if (!line.empty()) last = line;
  }
  return last;
}

BatchCell run_one(const fs::path& cell, const BatchOptions& options) {
  const fs::path log = cell / "run.log";
  std::vector<std::string> command = {options.program.string(), "run", cell.string(), "--quiet"};
  command.insert(command.end(), options.arguments.begin(), options.arguments.end());
  BatchCell outcome{.cell = cell, .exit_code = 0, .seconds = 0, .message = {}};
  try {
    write_text(log, "");
    const ProcessResult result = run_process(command, log);
    outcome.seconds = result.seconds;
    outcome.exit_code = result.signal ? 128 + *result.signal : result.exit_code;  // the shell's convention
    if (result.signal) outcome.message = how_it_ended(result);
    if (!result.signal && result.exit_code != 0) outcome.message = first_error(log);
  } catch (const OutputError& error) {  // no log, no process: this cell's matter, not the batch's
    outcome.exit_code = 5;
    outcome.message = error.what();
  }
  return outcome;
}

std::string progress_line(const BatchCell& cell, int n_done, std::size_t n, const std::vector<std::string>& only) {
  std::ostringstream line;
  line << '[' << n_done << '/' << n << "] " << cell.cell.string() << ": " << std::fixed << std::setprecision(1)
       << cell.seconds << " s: ";
  if (cell.exit_code == 0) {
    line << last_summary(cell.cell, only);
  } else {
    line << "FAILED, exit code " << cell.exit_code;
  }
  return line.str();
}

}  // namespace

std::vector<fs::path> find_cells(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw InputError(folder.string(), "a folder of cell folders", "none");
  std::vector<fs::path> cells;
  collect_cells(folder, cells);
  if (cells.empty()) {
    throw InputError(folder.string(), "cell folders (with a cell.toml) at or below it", "none",
                     "write a cell.toml beside each cell's images");
  }
  std::sort(cells.begin(), cells.end());
  return cells;
}

std::vector<BatchCell> run_batch(const std::vector<fs::path>& cells, const BatchOptions& options) {
  std::vector<BatchCell> outcomes(cells.size());
  std::mutex output;  // of the lines on the terminal only
  int n_done = 0;
  parallel_for(static_cast<int>(cells.size()), options.jobs, [&](int i) {
    outcomes[i] = run_one(cells[i], options);
    const std::lock_guard lock(output);
    ++n_done;
    if (!options.say) return;
    options.say(progress_line(outcomes[i], n_done, cells.size(), options.only));
  });
  return outcomes;
}

}  // namespace mbtfm::runner
