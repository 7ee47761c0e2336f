/// All cells of one picture (segment.cell = 0), each in a cell folder of its own beneath that of the picture. Each fit
/// allows for the forces of the others beneath their outlines.
#pragma once

#include <vector>

#include "pipeline/contract/path.h"

namespace mbtfm::runner {

/// Whether cell.toml asks for all cells; not if there is none.
bool asks_for_all_cells(const fs::path& folder);

/// folder/cell_N, with the settings of folder/cell.toml, its pictures and segment.cell = N.
/// @throws UsageError if an outline or fibres are drawn by hand, which belong to one cell
fs::path make_cell_of_picture(const fs::path& folder, int n);

/// How many cells the picture shows, as the segmentation of this one has it. @throws InputError if there is none
int n_cells_in_picture(const fs::path& cell);

/// Those that were made, by number; none if cell.toml does not ask for them.
std::vector<fs::path> cells_of_picture(const fs::path& folder);

}  // namespace mbtfm::runner
