#include "pipeline/runner/stages.h"

#include <fnmatch.h>

#include <algorithm>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/files/toml.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/stage/suggest.h"

namespace mbtfm::runner {

std::optional<std::string> PathArgument::condition() const {
  if (given == Given::always) return std::nullopt;
  return given == Given::if_there ? path : path + "/frames.csv";
}

const std::vector<Stage>& stages() {
  static const std::vector<std::string> cell_files = {"1_segment/adhesions.csv", "1_segment/fibres.csv",
                                                      "1_segment/fibre_points.csv", "1_segment/outline.csv"};
  static const std::string displacement = "2_track/displacement.csv";
  static const std::string network = "3_network/network.vtu";
  static const std::vector<Stage> list = {
      {.name = "segment",
       .folder = "1_segment",
       .images = {{"adhesion-image", "adhesion", ImageInput::Need::where_there}, {"actin-image", "actin"}},
       .optional_images = {{"outline-mask", "outline_mask"},
                           {"adhesion-mask", "adhesion_mask"},
                           {"outline-roi", "outline_roi"},
                           {"adhesion-rois", "adhesion_rois"},
                           {"fibre-rois", "fibre_rois"}},
       .output = {"out", "1_segment"},
       .writes = cell_files,
       .series = {"1_segment/*_2.csv"},
       .tables = {"", "images", "segment", "checks"}},
      {.name = "track",
       .folder = "2_track",
       .images = {{"stressed", "beads_stressed"}, {"relaxed", "beads_relaxed"}},
       .instead = ImageInput{"displacement", "displacement"},
       .beside = {{"cell_image", "adhesion"}, {"cell_image", "actin"}},
       .arguments = {{"adhesions", cell_files[0], PathArgument::Given::if_there}},
       .output = {"out", "2_track"},
       .reads_where_there = {cell_files[0]},
       .writes = {displacement},
       .series = {"2_track/frames.csv", "2_track/displacement_*.csv"},
       .tables = {"", "images", "track", "checks"},
       .effects = {"drift_affine", "effect_tolerance"},
       .keeps_frames = true},
      {.name = "network",
       .folder = "3_network",
       .arguments = {{"cell", "1_segment"}},
       .output = {"out", network},
       .reads = cell_files,
       .writes = {network},
       .tables = {"", "network"},
       .effects = {"stress_fibres"}},
      {.name = "fit",
       .folder = "4_fit",
       .arguments = {{"cell", "1_segment"},
                     {"network", network},
                     {"displacement", displacement},
                     {"frames", "2_track", PathArgument::Given::if_series}},
       .output = {"out", "4_fit"},
       .reads = {cell_files[0], cell_files[1], cell_files[2], cell_files[3], displacement, network},
       .reads_where_there = {"1_segment/adhesions_2.csv", "1_segment/fibres_2.csv", "1_segment/fibre_points_2.csv",
                             "1_segment/neighbours.csv"},
       .writes = {"4_fit/tensions.csv", "4_fit/adhesion_forces.csv", "4_fit/fit.json", "4_fit/contracted.vtu"},
       .series = {"4_fit/frames.csv", "4_fit/tracks.csv"},
       .tables = {"", "gel", "network", "cables", "substrate", "fit", "checks"},
       .effects = {"stress_fibres", "finite_thickness", "finite_sides", "depth_graded_gel", "vertical_displacement",
                   "large_strain", "common_motion", "beads_under_load", "channel_shift", "beyond_cut",
                   "cable_elasticity", "robust_loss", "time_coupling", "effect_tolerance"},
       .explains = true,
       .keeps_frames = true},
  };
  return list;
}

bool is_of_series(const Stage& stage, const std::string& file) {
  return std::ranges::any_of(
      stage.series, [&](const std::string& glob) { return fnmatch(glob.c_str(), file.c_str(), FNM_PATHNAME) == 0; });
}

bool is_asked(const Stage& stage, const std::vector<std::string>& only) {
  return only.empty() || std::find(only.begin(), only.end(), stage.name) != only.end();
}

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
  if (point == text.npos && !text.starts_with("pixel_size_um=")) {  // the one above the first table
    const std::string meant = stage::did_you_mean({"pixel_size_um"}, text.substr(0, equals));
    throw UsageError("--set " + text + ": expected its table, too: TABLE.KEY=VALUE, as in gel.youngs_modulus_kPa=4" +
                     (meant.empty() ? "" : "; " + meant));
  }
  const std::string table = point == text.npos ? "" : text.substr(0, point);
  const std::size_t begin = point == text.npos ? 0 : point + 1;
  std::set<std::string> tables = {"effects"};
  for (const Stage& stage : all_stages()) tables.insert(stage.tables.begin(), stage.tables.end());
  static const std::set<std::string> kInFileAlone = {"images", "run"};
  if (kInFileAlone.contains(table))
    throw UsageError("--set " + text + ": [" + table + "] is for cell.toml alone: write it there");
  if (!tables.contains(table)) {
    const std::string named = stage::did_you_mean({tables.begin(), tables.end()}, table);
    throw UsageError("--set " + text + ": expected a table of cell.toml, found '" + table + "'" +
                     (named.empty() ? "; there are " + listed(tables) : "; " + named));
  }
  const std::size_t comma = std::min(text.find(',', equals), text.size() - 1);
  const std::string next = text.substr(comma + 1, text.find('.', comma) - comma - 1);  // of "gel.a=1,gel.b=2": gel
  if (!next.empty() && tables.contains(next))
    throw UsageError("--set " + text + ": one value a flag: --set " + text.substr(0, comma) + " --set " +
                     text.substr(comma + 1));
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
    flags.push_back("--" + (setting.table.empty() ? "" : setting.table + ".") + setting.key + "=" + setting.value);
  }
  return flags;
}

}  // namespace mbtfm::runner
