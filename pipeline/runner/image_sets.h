/// Cell folders for images that lie together in one folder and belong together by their names.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/path.h"

namespace mbtfm::runner {

/// "adhesion={cell}_pax.tif": which files are images of this kind, and the part of their path that names the cell.
struct ImagePattern {
  std::string key;      ///< of [images] in cell.toml
  std::string pattern;  ///< path below the folder; {cell} and * stand for any text, ? for a letter, none for a slash
};

/// @throws UsageError where the key is none of [images], or the pattern does not contain {cell} exactly once
ImagePattern parse_pattern(const std::string& text);

/// Make FOLDER/CELL/cell.toml for each cell that the patterns find: the settings of `template_toml` (empty: none) and
/// an [images] table. A cell.toml that is there already stays as it is.
/// @returns the names of the cells, in alphabetical order
/// @throws InputError where no file fits, two files are the same image of one cell, or the template has [images] itself
std::vector<std::string> make_cell_folders(const fs::path& folder, const std::vector<ImagePattern>& patterns,
                                           const fs::path& template_toml);

}  // namespace mbtfm::runner
