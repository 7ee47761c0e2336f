/// Many cells, each in a process of its own: a crash never touches the others.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace mbtfm::runner {

/// Folders with a cell.toml at or below `folder`, in alphabetical order. A cell folder is not searched for more.
/// @throws InputError where there is none
std::vector<std::filesystem::path> find_cells(const std::filesystem::path& folder);

struct BatchOptions {
  std::filesystem::path program;       ///< mbtfm itself
  std::vector<std::string> arguments;  ///< passed on to `mbtfm run`
  int jobs = 1;                        ///< cells at a time
  std::vector<std::string> only;       ///< stages whose summary is told; empty: all
  std::function<void(const std::string&)> say;
};

struct BatchCell {
  std::filesystem::path cell;
  int exit_code = 0;
  double seconds = 0;
  std::string message;  ///< where it failed: the first error it printed
};

/// `mbtfm run` for every cell. What it prints goes to run.log in the cell folder.
std::vector<BatchCell> run_batch(const std::vector<std::filesystem::path>& cells, const BatchOptions& options);

}  // namespace mbtfm::runner
