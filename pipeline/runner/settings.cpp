#include "pipeline/runner/settings.h"

#include <algorithm>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/files/toml.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/stage/suggest.h"

namespace mbtfm::runner {

std::vector<Setting> unset_in(const std::filesystem::path& toml_file, const std::vector<Setting>& settings) {
  if (settings.empty()) return {};
  const toml::table whole = files::parse_toml(toml_file);
  std::vector<Setting> unset;
  for (const Setting& setting : settings)
    if (!whole[setting.table][setting.key]) unset.push_back(setting);
  return unset;
}

Setting parse_setting(const std::string& text) {
  const std::size_t equals = text.find('='), point = text.substr(0, equals).find('.');
  if (equals == text.npos || equals + 1 == text.size() || equals == (point == text.npos ? 0 : point + 1))
    throw UsageError("--set " + text + ": expected TABLE.KEY=VALUE, as in gel.youngs_modulus_kPa=4");
  if (point == text.npos && !text.starts_with("pixel_size_um="))  // the one above the first table
    throw UsageError("--set " + text + ": expected its table, too: TABLE.KEY=VALUE, as in gel.youngs_modulus_kPa=4");
  const std::string table = point == text.npos ? "" : text.substr(0, point);
  const std::size_t begin = point == text.npos ? 0 : point + 1;
  std::set<std::string> tables = {"effects"};
  for (const Stage& stage : all_stages()) tables.insert(stage.tables.begin(), stage.tables.end());
  if (!tables.contains(table)) {
    const std::string near = stage::nearest({tables.begin(), tables.end()}, table);
    throw UsageError("--set " + text + ": expected a table of cell.toml, found '" + table + "'" +
                     (near.empty() ? "" : "; " + stage::did_you_mean(near)));
  }
  return {table, text.substr(begin, equals - begin), text.substr(equals + 1)};
}

std::vector<Setting> with(std::vector<Setting> settings, const std::vector<Setting>& second) {
  for (const Setting& s : second) {
    std::erase_if(settings, [&](const Setting& first) { return first.table == s.table && first.key == s.key; });
    settings.push_back(s);
  }
  return settings;
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
