#include "pipeline/runner/settings.h"

#include <algorithm>

#include "pipeline/files/toml.h"

namespace mbtfm::runner {

std::vector<Setting> unset_in(const std::filesystem::path& toml_file, const std::vector<Setting>& settings) {
  if (settings.empty()) return {};
  const toml::table whole = files::parse_toml(toml_file);
  std::vector<Setting> unset;
  for (const Setting& setting : settings)
    if (!whole[setting.table][setting.key]) unset.push_back(setting);
  return unset;
}

std::vector<std::string> flags_of(const Stage& stage, const std::vector<Setting>& settings) {
  std::vector<std::string> flags;
  for (const Setting& setting : settings) {
    const bool is_effect = setting.table == "effects";
    const std::vector<std::string>& known = is_effect ? stage.effects : stage.tables;
    if (std::find(known.begin(), known.end(), is_effect ? setting.key : setting.table) == known.end()) continue;
    flags.push_back("--" + setting.key);
    flags.push_back(setting.value);
  }
  return flags;
}

}  // namespace mbtfm::runner
