#include "segment/survey/cell_toml.h"

#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
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

}  // namespace

Written cell_toml(const std::filesystem::path& folder) {
  const std::vector<std::string> names = images_in(folder);
  const Roles roles = roles_of(names);
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
    if (std::string(key).starts_with("beads_") && says.n_slices >= stacks::kFewestSlices) stacks = says;
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

}  // namespace mbtfm::survey
