/// Values that take the place of defaults: cell.toml's own win.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/runner/stages.h"

namespace mbtfm::runner {

/// Those that cell.toml does not set itself. @throws InputError where it is no TOML
std::vector<Setting> unset_in(const std::filesystem::path& toml_file, const std::vector<Setting>& settings);

/// The flags that give a stage those of its tables.
std::vector<std::string> flags_of(const Stage& stage, const std::vector<Setting>& settings);

}  // namespace mbtfm::runner
