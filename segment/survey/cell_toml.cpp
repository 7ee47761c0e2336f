#include "segment/survey/cell_toml.h"

#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/own_files.h"
#include "pipeline/stage/help.h"
#include "segment/images/image.h"
#include "segment/stacks/track.h"
#include "segment/survey/roles.h"

namespace mbtfm::survey {
namespace {

/// What an image file says of itself, as a comment; its calibration.
struct Says {
  std::string note;
  std::optional<double> pixel_size_um;
  int n_slices = 1;                 ///< of a TIFF: pages or slices of one channel and time
  std::optional<double> z_step_um;  ///< their distance
};

Says says_of(const std::filesystem::path& file) {
  if (files::is_folder(file))
    return {.note = stage::help_on("lines of cell.toml", "series", {std::to_string(images_in(file).size())}),
            .pixel_size_um = {},
            .z_step_um = {}};
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

/// A line of the file, as help.txt has it.
std::string line_of(const std::string& key, const std::vector<std::string>& values = {}) {
  return stage::help_on("lines of cell.toml", key, values) + "\n";
}

/// The table [track] of stacks, and what is to be completed in it.
std::string track_table(const Says& beads, std::vector<std::string>& open) {
  std::string text = "\n[track]\n" + line_of("stacks", {std::to_string(beads.n_slices)}) + line_of("z_points");
  open.emplace_back("z_points in [track]");
  if (beads.z_step_um) {
    const std::string step_um = shortest(*beads.z_step_um);
    text += line_of("z-step-known", {step_um}) + "# z_step_um = " + step_um + "\n";
  } else {
    text += line_of("z-step-missing");
    open.emplace_back("z_step_um in [track]");
  }
  return text + line_of("first-slice") + line_of("plane");
}

}  // namespace

Written cell_toml(const std::filesystem::path& folder) {
  const Roles roles = roles_of(folder);
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
      images += line_of("no-file", {key});
      open.push_back(std::string(key) + " in [images]");
      continue;
    }
    const Says says = says_of(folder / file->second);
    if (std::string(key).starts_with("beads_") && says.n_slices >= stacks::kFewestSlices) stacks = says;
    images += std::string(key) + " = " + quoted(file->second) + "    # " + says.note + "\n";
    if (!pixel_size_um && says.pixel_size_um) {
      pixel_size_um = says.pixel_size_um;
      calibrated = file->second;
    }
  }
  if (!roles.unknown.empty()) images += line_of("unused", {listed(roles.unknown)});
  std::string text = line_of("written") + "\n";
  if (pixel_size_um) {
    const std::string size_um = shortest(*pixel_size_um);
    text += line_of("pixel-size-known", {calibrated, size_um}) + "# pixel_size_um = " + size_um + "\n";
  } else {
    text += line_of("pixel-size-missing");
    open.emplace_back("pixel_size_um");
  }
  text += "\n[gel]\n" + line_of("modulus") + line_of("shear-modulus") + line_of("poisson-ratio") +
          line_of("thickness") + "\n[images]\n" + images;
  if (stacks) text += track_table(*stacks, open);
  open.insert(open.begin(), "youngs_modulus_kPa in [gel]");
  return {.text = text, .open = listed(open)};
}

}  // namespace mbtfm::survey
