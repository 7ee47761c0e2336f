/// Which image files belong to a cell: the [images] table of cell.toml.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/path.h"
#include "pipeline/runner/stages.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::runner {

/// @throws InputError that says which folder was probably meant, where there is none of that name
void require_folder(const fs::path& folder, const std::string& expected);

/// File names or globs, relative to the cell folder; several with | between them.
struct ImageNames {
  std::string adhesion = "paxillin.tif";  ///< paxillin is the adhesion protein most often tagged
  std::string actin = "actin.tif";
  std::string beads_stressed = "beads_stressed.tif";
  std::string beads_relaxed = "beads_relaxed.tif";
  std::string surface_beads = "surface_beads.tif";
  std::string displacement;  ///< a field from another program, instead of the beads' images
  // drawn by hand in ImageJ, used where they are there
  std::string outline_roi = "outline.roi|outline.zip";
  std::string adhesion_rois = "adhesions.zip|adhesions.roi";
  std::string fibre_rois = "fibres.zip|fibres.roi";
  // masks and label images of other programs, likewise
  std::string outline_mask = "outline_mask.tif|outline_mask.png";
  std::string adhesion_mask = "adhesion_mask.tif|adhesion_mask.png";
  CellWith cell_with = CellWith::stressed;  ///< the tracking's; here so that it is known in [images]
  std::string cell_labels = "cell_labels.tif|cell_labels.png";  ///< of a colony
};
void declare(stage::ParameterList& list, ImageNames& names);
/// Names of [images] from cell.toml. @throws InputError where there is no cell.toml, or for an unknown table or key
ImageNames read_image_names(const fs::path& cell);

/// Of files, in [images].
std::vector<std::string> image_keys();
bool is_image_key(const std::string& key);
/// The name or glob of a key of [images]. @throws InternalError for any other key
const std::string& name_of_image(const ImageNames& names, const std::string& key);

/// The inputs of a stage: its images, or, for tracking, the displacement field that is given instead.
std::vector<ImageInput> images_of(const Stage& stage, const ImageNames& names);

struct ImageMatch {
  std::vector<fs::path> files = {};  ///< in alphabetical order
  std::string pattern;
};
/// Files of `folder` that a name or glob (*, ?, [abc] in its last part) matches, or one of several with | between
/// them. A file of exactly that name wins over a glob.
ImageMatch match_image(const fs::path& folder, const std::string& name_or_glob);

/// On pictures in the folder that nothing names, where one of the cell itself is missing; empty: there are none.
std::string unused_pictures(const fs::path& cell, const ImageNames& names);

/// Of pyTFM's u.npy, its v.npy; empty for all others.
fs::path other_half(const fs::path& file);

/// The one file that is meant. @throws InputError where there is none, or several: lists them
fs::path resolve_image(const fs::path& folder, const ImageNames& names, const std::string& key);

/// The file of a stage's image; none where it need not be there and is not.
std::optional<fs::path> resolve_image(const fs::path& folder, const ImageNames& names, const ImageInput& image);

/// The same of a file that need not be there where its name is left at the default.
std::optional<fs::path> resolve_optional_image(const fs::path& folder, const ImageNames& names, const std::string& key);

}  // namespace mbtfm::runner
