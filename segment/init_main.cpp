/// mbtfm-init: a cell.toml from what the files of a folder say, with notes on what is to be completed.
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/images/image.h"
#include "segment/survey/roles.h"

namespace {

using namespace mbtfm;

/// What an image file says of itself, as a comment; its calibration.
struct Says {
  std::string note;
  std::optional<double> pixel_size_um;
  int n_slices = 1;                 ///< of a TIFF: pages or slices of one channel and time
  std::optional<double> z_step_um;  ///< their distance
};

/// A bead image of that many slices may be a stack in space: fewer say nothing of a bead's picture along z.
constexpr int kFewestSlices = 8;

Says says_of(const fs::path& file) {
  try {
    const images::Image image = images::read_image(file);
    Says says{.note = std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels",
              .pixel_size_um = image.pixel_size_um,
              .z_step_um = {}};
    if (!images::is_tiff(file)) return says;
    const std::vector<images::Image> slices = images::read_slices(file, {});
    says.n_slices = static_cast<int>(slices.size());
    says.z_step_um = slices.front().z_step_um;
    if (says.n_slices > 1) says.note += ", " + std::to_string(says.n_slices) + " slices";
    return says;
  } catch (const InputError& error) {
    return {
        .note = "expected " + error.expected + ", found " + error.found + (error.hint.empty() ? "" : ": " + error.hint),
        .pixel_size_um = {},
        .z_step_um = {}};
  }
}

std::string quoted(const std::string& name) {
  std::string text = "\"";
  for (const char c : name) text += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return text + "\"";
}

struct Written {
  std::string text, open;  ///< of cell.toml; what is to be completed
};

/// The table [track] of stacks, and what is to be completed in it.
std::string track_table(const Says& beads, std::vector<std::string>& open) {
  std::string text = "\n[track]\n# The bead images are stacks of " + std::to_string(beads.n_slices) +
                     " slices. Their beads are followed in space as soon as z_points is given.\n"
                     "# z_points = \"into-gel\"    # needed: the first slice is the highest; \"out-of-gel\": the first "
                     "is the deepest\n";
  open.emplace_back("z_points in [track]");
  if (beads.z_step_um) {
    text += "# The files say that the slices are " + shortest(*beads.z_step_um) + " um apart. To overrule it:\n" +
            "# z_step_um = " + shortest(*beads.z_step_um) + "\n";
  } else {
    text += "# z_step_um = 0.5    # needed, as no file says it: how far the stage moved between two slices (um)\n";
    open.emplace_back("z_step_um in [track]");
  }
  return text +
         "# first_slice_z_um = 0    # z of the upper face of the highest slice; z = 0 is where gel.thickness_um counts "
         "from\n# dimensions = \"plane\"    # instead of all this: follow beads in the maximum projection, on a flat "
         "gel\n";
}

Written cell_toml(const fs::path& folder) {
  const std::vector<std::string> names = survey::images_in(folder);
  const survey::Roles roles = survey::roles_of(names);
  std::string images;
  std::vector<std::string> open;
  std::optional<double> pixel_size_um;
  std::string calibrated;
  std::optional<Says> stacks;
  for (const char* key : {"beads_stressed", "beads_relaxed", "surface_beads", "adhesion", "actin"}) {
    const auto file = roles.files.find(key);
    if (file == roles.files.end()) {
      const bool is_needed = key != std::string("surface_beads") && (!stacks || std::string(key).starts_with("beads_"));
      if (!is_needed) continue;  // a cell in space may have no other images
      images += "# " + std::string(key) + " = \"\"    # which file? no name shows it\n";
      open.push_back(std::string(key) + " in [images]");
      continue;
    }
    const Says says = says_of(folder / file->second);
    if (std::string(key).starts_with("beads_") && says.n_slices >= kFewestSlices) stacks = says;
    images += std::string(key) + " = " + quoted(file->second) + "    # " + says.note + "\n";
    if (!pixel_size_um && says.pixel_size_um) {
      pixel_size_um = says.pixel_size_um;
      calibrated = file->second;
    }
  }
  if (!roles.unknown.empty()) images += "# other images here: " + listed(roles.unknown) + "\n";
  std::string text =
      "# Written by mbtfm init from the files of this folder. What is behind a # is a note or not used.\n\n";
  if (pixel_size_um) {
    text += "# The calibration of " + calibrated + " is " + shortest(*pixel_size_um) +
            " um: each image's own is used. To overrule it:\n" + "# pixel_size_um = " + shortest(*pixel_size_um) + "\n";
  } else {
    text += "# pixel_size_um = 0.1    # needed, as no image has a calibration: side of a pixel on the specimen\n";
    open.emplace_back("pixel_size_um");
  }
  text +=
      "\n[gel]\n# youngs_modulus_kPa = 8.4    # needed: as measured; all forces are proportional to it\n"
      "# shear_modulus_kPa = 2.8    # in its place, if a "
      "rheometer gave G: E is about 3 G\n# poisson_ratio = 0.49    # of the gel; 0.49 if not given\n# thickness_um = "
      "60    # of the gel; 60 if not "
      "given\n"
      "\n[images]\n" +
      images;
  if (stacks) text += track_table(*stacks, open);
  open.insert(open.begin(), "youngs_modulus_kPa in [gel]");
  return {.text = text, .open = listed(open)};
}

/// A cell whose cell.toml others are made like.
struct Model {
  fs::path cell;
  std::string text;  ///< of its cell.toml
  runner::ImageNames images;
};

/// Every such text in quotes becomes another one.
void replace_quoted(std::string& text, const std::string& from, const std::string& to) {
  for (const std::string quote : {"\"", "'"})
    for (std::size_t at = 0; (at = text.find(quote + from + quote, at)) != text.npos; at += to.size())
      text.replace(at + 1, from.size(), to);
}

/// The name in the model's cell.toml, as it is or with this folder's name in place of the model's.
/// @throws InputError if neither is the name of one file here
void find_like(const Model& model, const std::string& key, const fs::path& folder, std::string& text) {
  const std::string name = runner::name_of_image(model.images, key),
                    theirs = fs::weakly_canonical(model.cell).filename(), ours = folder.filename();
  if (runner::match_image(model.cell, name).files.size() != 1) return;
  if (runner::match_image(folder, name).files.size() == 1) return;
  std::string other = name;
  for (std::size_t at = 0; (at = other.find(theirs, at)) != other.npos; at += ours.size())
    other.replace(at, theirs.size(), ours);
  if (runner::match_image(folder, other).files.size() != 1)
    throw InputError(folder.string(), "one file '" + other + "' (" + key + "), as in " + model.cell.string(),
                     std::to_string(runner::match_image(folder, other).files.size()),
                     "rename the picture, or write this one by itself: mbtfm init '" + folder.string() + "'");
  replace_quoted(text, name, other);
}

/// A cell.toml for each folder below that has pictures and none. Those that cannot be made are said, and stay.
StageReport init_like(stage::StageContext& context, bool& is_whole) {
  const fs::path study = context.input("cell", {}), cell = context.input("like", {"cell.toml"});
  const Model model{cell, files::read_text(cell / "cell.toml"), runner::read_image_names(cell)};
  int n_written = 0;
  std::string open;
  for (const runner::SkippedFolder& found : runner::search_cells(study).skipped) {
    if (!found.lacks_settings) {
      open += "\n  " + found.folder.string() + ": " + found.why;
      continue;
    }
    try {
      std::string text = model.text;
      for (const std::string& key : runner::image_keys()) find_like(model, key, found.folder, text);
      files::write_text(context.pending_path(found.folder / "cell.toml"), text);
      ++n_written;
    } catch (const InputError& error) {
      open += "\n  " + std::string(error.what()) + "; " + error.hint;
    }
  }
  is_whole = open.empty();
  StageReport report;
  report.summary = counted(n_written, "cell.toml", "cell.toml") + " written like that of " + cell.string() +
                   (open.empty() ? "" : "; not written:" + open);
  return report;
}

StageReport init(stage::StageContext& context, bool& is_whole) {
  if (context.has_input("like")) return init_like(context, is_whole);
  const fs::path folder = context.input("cell", {});
  runner::require_folder(folder, "a folder with the images of a cell");
  for (const fs::path& file : {folder / "cell.toml", context.outputs_.at("out")})
    if (fs::symlink_status(file).type() != fs::file_type::not_found)
      throw InputError(file.string(), "no cell.toml yet", "one", "it is yours: edit it, or rename it first");
  if (survey::images_in(folder).empty()) {
    for (const fs::path& below : files::visible_in(folder))
      if (files::is_folder(below) && !survey::images_in(below).empty())
        throw InputError(folder.string(), "images of a cell: TIFF, PNG or JPEG", "some in the folder " + below.string(),
                         "if that is the cell: mbtfm init '" + below.string() + "'; else move its images up");
    throw InputError(folder.string(), "images of a cell: TIFF, PNG or JPEG", "none",
                     "files of a microscope (nd2, czi, lif): in Fiji, File > Import > Bio-Formats, then File > Save As "
                     "> Tiff; or bfconvert IN OUT.ome.tif");
  }
  const Written written = cell_toml(folder);
  files::write_text(context.output("out"), written.text);
  StageReport report;
  report.summary = "cell.toml is written; complete in it: " + written.open;
  return report;
}

}  // namespace

int main(int argc, char** argv) {
  using enum mbtfm::stage::FileArgument::Kind;
  bool is_whole = true;
  const int code = mbtfm::stage::run_stage(
      {.name = "init", .files = {{"cell", input}, {"like", optional_input}, {"out", output}}}, argc, argv, [](auto&) {},
      [&](mbtfm::stage::StageContext& context) { return init(context, is_whole); });
  return code == mbtfm::exit_code::kDone && !is_whole ? mbtfm::exit_code::kFailed : code;
}
