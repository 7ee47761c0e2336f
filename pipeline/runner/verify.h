/// Are the files of a cell still those that its run.json lists, and does it come out the same once more?
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pipeline/contract/path.h"

namespace mbtfm::runner {

struct RunOptions;

struct Verification {
  int n_files = 0;
  std::vector<std::string> differences = {};  ///< a line each: "4_fit/tensions.csv differs (output of fit)"
};

/// Hash every input and output that run.json names, without any short cut, and compare the parameters of cell.toml.
/// @throws InputError where there is no run.json, or a damaged one
Verification verify_cell(const fs::path& cell);

/// Repeat the run that `run_json` records in the new cell folder `out`: its inputs where they lie (below `inputs`,
/// which is the old cell folder as a rule), their hashes checked, its parameters, and its version, or `note` says that
/// this is another one. Then compare all outputs.
/// @throws InputError where an input is gone or has changed, or where `out` is there already; what run_cell throws
Verification repeat_run(const fs::path& run_json, const fs::path& inputs, const fs::path& out,
                        const RunOptions& options, const std::function<void(const std::string&)>& note);

}  // namespace mbtfm::runner
