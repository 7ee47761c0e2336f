#include "pipeline/runner/cell_stages.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/toml.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::runner {
namespace {

constexpr const char *kDisplacement = "2_track/displacement_3d.csv", *kSurfaceBeads = "2_track/surface_beads.csv",
                     *kSurface = "3_surface/surface.vtp", *kOutline = "1_segment/outline.csv";

const Stage& stage_named(const std::string& name) {
  const auto stage = std::ranges::find(stages(), name, &Stage::name);
  MBTFM_ASSERT(stage != stages().end());
  return *stage;
}

Stage tracking() {
  Stage stage = stage_named("track");
  stage.instead.reset();
  stage.beside.clear();
  stage.arguments.clear();
  stage.reads_where_there.clear();
  stage.optional_images = {{"surface_beads", "surface_beads"}};
  stage.writes = {kDisplacement};
  stage.series = {kSurfaceBeads};
  stage.keeps_frames = false;
  return stage;
}

Stage surface() {
  return {.name = "surface",
          .folder = "3_surface",
          .arguments = {{"beads", kDisplacement}},
          .output = {"out", kSurface},
          .reads = {kDisplacement},
          .writes = {kSurface},
          .tables = {"", "surface", "checks"},
          .settings = {{"surface", "z_points", "into-gel"}}};  // as tables of the tracker are
}

Stage traction() {
  return {.name = "traction",
          .folder = "4_traction",
          .arguments = {{"displacement", kDisplacement}, {"surface", kSurface}},
          .output = {"out", "4_traction/traction.csv"},
          .reads = {kDisplacement, kSurface},
          .writes = {"4_traction/traction.csv", "4_traction/traction.vtp", "4_traction/traction.json"},
          .series = {"4_traction/traction_*"},
          .tables = {"", "gel", "traction", "substrate", "checks"},
          .effects = {"large_strain", "common_motion", "effect_tolerance"}};
}

Stage sheet() {
  return {.name = "sheet",
          .folder = "3_sheet",
          .optional_images = {{"adhesive", "adhesion_mask"}, {"cells", "cell_labels"}},
          .arguments = {{"displacement", "2_track/displacement.csv"}},
          .output = {"out", "3_sheet"},
          .reads = {"2_track/displacement.csv"},
          .writes = {"3_sheet/sheet_fit.csv", "3_sheet/sheet_models.csv", "3_sheet/sheet.csv", "3_sheet/traction.csv",
                     "3_sheet/displacement.csv", "3_sheet/sheet.json", "3_sheet/sheet.svg", "3_sheet/sheet.html",
                     "3_sheet/sheet.vtu"},
          .series = {"3_sheet/contraction.csv", "3_sheet/borders.csv", "3_sheet/cell_tension.csv"},
          .tables = {"", "gel", "sheet", "substrate", "checks"},
          .effects = {"finite_thickness", "finite_sides", "depth_graded_gel", "common_motion", "beads_under_load",
                      "effect_tolerance"}};
}

/// A value of cell.toml, as text; empty where it is not set.
std::string text_in(const toml::table& whole, const char* table, const char* key) {
  return whole[table][key].value_or(std::string());
}

bool has_image(const fs::path& cell, const ImageNames& images, const char* key) {
  return !match_image(cell, name_of_image(images, key)).files.empty();
}

/// Why the beads are followed in space; empty where they are not. As the tracker decides, from the same settings.
std::string why_in_space(const fs::path& cell, const toml::table& toml) {
  const std::string dimensions = text_in(toml, "track", "dimensions");
  if (dimensions == "plane") return {};
  if (dimensions == "space") return "track.dimensions is space";
  for (const char* one : {"relaxed_z", "stressed_z", "relaxed_page", "stressed_page"})
    if (toml["track"][one]) return {};
  if (toml["track"]["z_points"]) return "track.z_points is set: the bead images are stacks";
  if (files::is_own_file(cell / kDisplacement) && !files::is_own_file(cell / "2_track/displacement.csv"))
    return std::string(kDisplacement) + " is there";
  return {};
}

/// What is seen of the cell besides its beads is laid onto the surface from above.
bool has_cell(const fs::path& cell, const ImageNames& images) {
  return has_image(cell, images, "adhesion") || has_image(cell, images, "actin") || files::is_own_file(cell / kOutline);
}
/// Somebody saw them; candidates along the rim, which a flat cell may have, are none.
bool has_adhesions(const fs::path& cell, const ImageNames& images) {
  return has_image(cell, images, "adhesion") || has_image(cell, images, "adhesion_mask") ||
         has_image(cell, images, "adhesion_rois") ||
         (files::is_own_file(cell / "1_segment/adhesions.csv") && !files::is_own_file(cell / "1_segment/record.json"));
}

void read_file(Stage& stage, const std::string& flag, const std::string& file) {
  stage.arguments.push_back({flag, file});
  stage.reads.push_back(file);
}

/// The sheet's outline where no image of the cell is there: a table, a selection or a mask. @returns whether there is
/// one
bool take_given_outline(const fs::path& cell, const ImageNames& images, CellStages& of, Stage& sheet) {
  if (files::is_own_file(cell / kOutline)) {
    read_file(sheet, "outline", kOutline);
    of.why += std::string("; its outline is ") + kOutline;
    return true;
  }
  for (const char* key : {"outline_roi", "outline_mask"}) {
    if (!has_image(cell, images, key)) continue;
    sheet.images = {{"outline", key}};
    of.why += std::string("; its outline is ") + key;
    return true;
  }
  return false;
}

CellStages stages_as_sheet(const fs::path& cell, const ImageNames& images, const RunSettings& settings) {
  CellStages of{.kind = CellKind::sheet, .why = "run.model is sheet"};
  Stage track = stage_named("track"), last = sheet();
  track.keeps_frames = false;
  const bool has_images = has_image(cell, images, "adhesion") || has_image(cell, images, "actin");
  if (!has_images && take_given_outline(cell, images, of, last)) {
    if (settings.bundles)
      throw InputError((cell / "cell.toml").string() + ": [run] bundles", "an image of the cell", "an outline alone",
                       "leave bundles out, or add the actin image");
    track.arguments.clear();
    track.reads_where_there.clear();
    of.stages = {std::move(track), std::move(last)};
    of.chains = {{0}};
    return of;
  }
  Stage segment = stage_named("segment");
  // on a sheet's cell the mask says where the sheet adheres
  std::erase_if(segment.optional_images, [](const ImageInput& image) { return image.key == "adhesion_mask"; });
  const bool are_seen = has_image(cell, images, "adhesion") || has_image(cell, images, "adhesion_rois");
  if (!are_seen) segment.settings = {{"segment", "adhesions", "none"}};
  read_file(last, "outline", kOutline);
  if (are_seen) read_file(last, "adhesions", "1_segment/adhesions.csv");
  if (settings.bundles) read_file(last, "bundles", "1_segment/fibre_points.csv");
  of.why += "; its outline is found in the images";
  of.stages = {std::move(segment), std::move(track), std::move(last)};
  of.first = {0};  // where the cell holds its gel shows which bead is which
  of.chains = {{1}};
  return of;
}

}  // namespace

void declare(stage::ParameterList& list, RunSettings& settings) {
  list.table("run");
  list.add("model", settings.model);
  list.add("bundles", settings.bundles);
}

RunSettings read_run_settings(const fs::path& cell) {
  RunSettings settings;
  stage::ParameterList list;
  declare(list, settings);
  stage::read_toml(list, cell / "cell.toml");
  return settings;
}

const std::vector<Stage>& stages_of_sheet() {
  static const std::vector<Stage> list = {stage_named("segment"), stage_named("track"), sheet()};
  return list;
}

const std::vector<Stage>& stages_in_space() {
  static const std::vector<Stage> list = {stage_named("segment"), tracking(), surface(), traction()};
  return list;
}

const std::vector<Stage>& all_stages() {
  static const std::vector<Stage> list = [] {
    std::vector<Stage> all = stages();
    for (const auto& others : {stages_in_space(), stages_of_sheet()}) {
      for (const Stage& stage : others)
        if (std::ranges::find(all, stage.name, &Stage::name) == all.end()) all.push_back(stage);
    }
    return all;
  }();
  return list;
}

std::string stage_names() {
  std::string names;
  const auto n = all_stages().size();
  for (std::size_t i = 0; i < n; ++i) names += (i == 0 ? "" : i + 1 < n ? ", " : " or ") + all_stages()[i].name;
  return names;
}

CellStages stages_of(const fs::path& cell, const ImageNames& images) {
  const toml::table toml = files::parse_toml(cell / "cell.toml");
  CellStages of{.kind = CellKind::space, .why = why_in_space(cell, toml)};
  const RunSettings settings = toml.contains("run") ? read_run_settings(cell) : RunSettings{};  // most have none
  if (settings.model == PullModel::sheet) {
    if (of.why.empty()) return stages_as_sheet(cell, images, settings);
    throw InputError((cell / "cell.toml").string() + ": [run] model", "fibres: beads in space have no sheet", "sheet",
                     "leave model out; " + of.why);
  }
  if (of.why.empty()) {
    of.kind = CellKind::plane;
    of.stages = stages();
    of.first = {0};  // where the cell holds its gel shows which bead is which
    of.chains = {{1}, {2}};
    return of;
  }
  Stage surface_stage = surface(), traction_stage = traction();
  if (!text_in(toml, "surface", "formula").empty()) {
    surface_stage.arguments.clear();
    surface_stage.reads.clear();
    of.why += "; the surface is [surface] formula";
  } else if (has_image(cell, images, "surface_beads") || files::is_own_file(cell / kSurfaceBeads)) {
    surface_stage.arguments = {{"points", kSurfaceBeads}};
    surface_stage.reads = {kSurfaceBeads};
    of.why += "; the surface is that of its own beads";
  } else {
    of.why += "; the surface is where the beads in the gel end";
  }
  const bool has_images = has_cell(cell, images);
  if (has_images) {
    of.stages.push_back(stage_named("segment"));
    read_file(traction_stage, "outline", kOutline);
    const bool are_seen = has_adhesions(cell, images);
    if (are_seen) read_file(traction_stage, "adhesions", "1_segment/adhesions.csv");
    of.why +=
        are_seen ? "; the adhesions seen from above are laid onto it" : "; the outline seen from above is laid onto it";
  } else {
    of.why += "; no image of the cell: tractions anywhere above the beads";
  }
  const int first = static_cast<int>(of.stages.size());
  of.chains = {{first, first + 1}};
  if (has_images) of.chains.push_back({0});
  for (Stage& stage : std::vector<Stage>{tracking(), surface_stage, traction_stage})
    of.stages.push_back(std::move(stage));
  return of;
}

std::string executable_of(const Stage& stage, const fs::path& stage_folder) {
  return (stage_folder / ("mbtfm-" + stage.name)).string();
}

std::vector<std::string> command_of(const Stage& stage, const fs::path& stage_folder, const fs::path& cell,
                                    const fs::path& folder, const ImageNames& images, int threads) {
  std::vector<std::string> command = {executable_of(stage, stage_folder)};
  const auto add = [&](const std::string& flag, const std::string& value) {
    command.push_back("--" + flag);
    command.push_back(value);
  };
  for (const ImageInput& image : images_of(stage, images))
    if (const auto file = resolve_image(cell, images, image)) add(image.flag, file->string());
  for (const ImageInput& image : stage.optional_images)
    if (const auto file = resolve_optional_image(cell, images, image.key)) add(image.flag, file->string());
  for (const PathArgument& argument : stage.arguments) {
    const auto condition = argument.condition();
    if (!condition || files::is_own_file(folder / *condition)) add(argument.flag, (folder / argument.path).string());
  }
  add("config", (folder / "cell.toml").string());
  for (const Setting& setting : stage.settings) add(setting.key, setting.value);
  add(stage.output.flag, (folder / stage.output.path).string());
  add("threads", std::to_string(threads));
  return command;
}

std::vector<std::string> to_look_at(const Stage& stage, const fs::path& cell, const ImageNames& images) {
  std::vector<std::string> flags;
  for (const ImageInput& other : stage.beside) {
    const auto file = resolve_optional_image(cell, images, other.key);
    if (file && flags.empty()) flags = {"--" + other.flag, file->string()};  // they are of one size
  }
  if (flags.empty()) return {};
  for (const ImageInput& image : images_of(stage, images)) {
    if (const auto file = resolve_image(cell, images, image)) {
      flags.push_back("--" + image.flag);
      flags.push_back(file->string());
    }
  }
  return flags;
}

}  // namespace mbtfm::runner
