/// What people read of parameters, programs and flags: help.txt.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace mbtfm::stage {

/// @param section  a table of cell.toml, or a program
/// @param values   in place of each {}
/// @return empty: there is no such text
std::string help_on(const std::string& section, const std::string& key, const std::vector<std::string>& values = {});

/// Give a program, its commands and their flags the texts that they lack, by their names.
void describe(CLI::App& app, const std::string& name);

}  // namespace mbtfm::stage
