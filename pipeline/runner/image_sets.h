/// Cell folders that are made: for images that lie together in one folder and belong together by their names, and for
/// all cells of one picture.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/path.h"

namespace mbtfm::runner {

/// "adhesion={cell}_pax.tif": which files are images of this kind, and the part of their path that names the cell.
struct ImagePattern {
  std::string key;      ///< of [images] in cell.toml
  std::string pattern;  ///< path below the folder; {cell} and * match any text, ? for a letter, none for a slash
};

/// @throws UsageError where the key is none of [images], or the pattern does not contain {cell} exactly once
ImagePattern parse_pattern(const std::string& text);

/// Make FOLDER/CELL/cell.toml for each cell that the patterns find: the settings of `template_toml` (empty: none) and
/// an [images] table. A cell.toml that is there already stays as it is.
/// @returns the names of the cells, in alphabetical order
/// @throws InputError where no file fits, two files are the same image of one cell, or the template has [images] itself
std::vector<std::string> make_cell_folders(const fs::path& folder, const std::vector<ImagePattern>& patterns,
                                           const fs::path& template_toml);

// All cells of one picture (segment.cell = 0), each in a cell folder of its own beneath that of the picture. Each fit
// allows for the forces of the others beneath their outlines.

/// Whether cell.toml asks for all cells; not if there is none.
bool asks_for_all_cells(const fs::path& folder);

/// folder/cell_N, with the settings of folder/cell.toml, its pictures and segment.cell = N.
/// @throws UsageError if an outline or fibres are drawn by hand, which belong to one cell
fs::path make_cell_of_picture(const fs::path& folder, int n);

/// Whether the folder is one that make_cell_of_picture made.
bool is_made_for_picture(const fs::path& cell);

/// How many cells the picture shows, as the segmentation of this one has it. @throws InputError if there is none
int n_cells_in_picture(const fs::path& cell);

/// Those that were made, by number; none if cell.toml does not ask for them.
std::vector<fs::path> cells_of_picture(const fs::path& folder);

}  // namespace mbtfm::runner
