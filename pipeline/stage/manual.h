/// Manual pages and shell completions, from the declarations that --help prints.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace mbtfm::stage {

// A program's command line as manual and completions need it.

struct DeclaredOption {
  std::string flag;   ///< "--model"; empty: positional
  std::string name;   ///< of what a positional means, or of the option's value: "CELL", "FILE"
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

/// The words that an option takes, by its flag ("--model").
using WordsOfFlags = std::map<std::string, std::vector<std::string>>;

/// The program's page as troff; its subcommands, if any, are sections of it.
std::string manual_page(const CLI::App& app);
std::string bash_completion(const CLI::App& app, const WordsOfFlags& words);
std::string zsh_completion(const CLI::App& app, const WordsOfFlags& words);
std::string fish_completion(const CLI::App& app, const WordsOfFlags& words);

/// The four of them, where an installation has them below its `share`. @throws OutputError
void write_manuals(const CLI::App& app, const WordsOfFlags& words, const std::filesystem::path& share);

}  // namespace mbtfm::stage
