/// Values that take the place of defaults, where cell.toml's own win, or of those in cell.toml.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/runner/stages.h"

namespace mbtfm::runner {

/// Those that cell.toml does not set itself. @throws InputError where it is no TOML
std::vector<Setting> unset_in(const std::filesystem::path& toml_file, const std::vector<Setting>& settings);

/// A value in place of cell.toml's: "gel.youngs_modulus_kPa=4", "pixel_size_um=0.1".
/// @throws UsageError where it is no such text, or no stage has a table of that name
Setting parse_setting(const std::string& text);

/// Both, and where they set the same the second.
std::vector<Setting> with(std::vector<Setting> settings, const std::vector<Setting>& second);

/// The flags that give a stage those of its tables.
std::vector<std::string> flags_of(const Stage& stage, const std::vector<Setting>& settings);

}  // namespace mbtfm::runner
