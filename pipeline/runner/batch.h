/// Many cells, each in processes of its own: a crash, a hang or a hunger for memory never touches the others.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pipeline/contract/path.h"
#include "pipeline/runner/run_cell.h"

namespace mbtfm::runner {

/// A folder that could not be searched for cells, or seems to be one.
struct SkippedFolder {
  fs::path folder;
  std::string why;              ///< with the remedy
  bool lacks_settings = false;  ///< it has pictures, and no cell.toml or one of another name
};

struct FoundCells {
  std::vector<fs::path> cells = {};  ///< in alphabetical order
  std::vector<SkippedFolder> skipped;
};

/// Folders with a cell.toml at or below `folder`. A cell folder is not searched for more, nor are links followed, nor
/// what is hidden looked at. Folders with pictures and no cell at or below them are among the skipped ones.
FoundCells search_cells(const fs::path& folder);
/// The same. @throws InputError where there is no cell
FoundCells find_cells(const fs::path& folder);
/// A file in a folder without cell.toml that seems to be one of another name, as cell.toml.txt; empty: none.
std::string misnamed_settings(const std::vector<fs::path>& entries);

struct BatchCell;

struct BatchOptions {
  fs::path program;                                  ///< mbtfm itself
  std::vector<std::string> arguments = {};           ///< passed on to `mbtfm run`
  int jobs = 1;                                      ///< cells at a time
  int threads = 1;                                   ///< to look at cells with
  RunOptions run;                                    ///< what `arguments` say, to know which cells are done
  std::function<void(const std::string&)> say;       ///< a line for each cell that was run
  std::function<void(const BatchCell&)> ended = {};  ///< called for each cell when it has ended, one at a time
  std::function<void(const std::string&)> show;      ///< a line that the next one replaces, for a terminal
};

struct BatchCell {
  fs::path cell = {};
  int exit_code = 0;
  bool is_left_undone = false;  ///< nothing failed: it was not run, or another run is in it
  double seconds = 0;
  std::string message = {};       ///< why it failed: the first error it printed
  std::string failed_stage = {};  ///< empty where it failed outside of one
  std::string how = {};           ///< "exit code 3", "timed out after 60 s"
};
/// What became of it as a JSON object on a line (docs/formats/json.md, "Events").
std::string event_of(const BatchCell& cell);

/// `mbtfm run` for every cell that is not up to date; what it prints goes to run.log in the cell folder. Cells that
/// another batch works on come last: what it leaves undone is done then.
/// @throws Interrupted
std::vector<BatchCell> run_batch(const std::vector<fs::path>& cells, const BatchOptions& options);

/// The same for the cells as they are: runs nothing. What is left undone counts as failed.
std::vector<BatchCell> outcomes_so_far(const std::vector<fs::path>& cells, const RunOptions& options, int threads);

/// A table, as CSV, of each stage of each cell: cell, stage, state, why. Runs nothing. A cell that cannot be read has
/// one row, state "unreadable".
std::string list_cells(const std::vector<fs::path>& cells, const RunOptions& options, int threads);

}  // namespace mbtfm::runner
