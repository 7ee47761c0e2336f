/// A program's command line as manual and completions need it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace mbtfm::stage {

struct DeclaredOption {
  std::string flag;   ///< "--model"; empty: positional
  std::string name;   ///< of what a positional stands for, or of the option's value: "CELL", "FILE"
  std::string group;  ///< "Inputs"
  std::string meaning;
  bool takes_value = false;
};

struct DeclaredCommand {
  std::string name, meaning;
  std::vector<DeclaredOption> options = {};  ///< positionals first, each in the order of its declaration
  std::vector<DeclaredCommand> subcommands = {};
};

/// Without what is hidden from --help.
DeclaredCommand declared(const CLI::App& app);

}  // namespace mbtfm::stage
