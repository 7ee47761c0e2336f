/// Cells beyond the border of the picture, which pull at the same gel.
#pragma once

#include <string>
#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::tensions {

/// Pieces of the surface along the border of the beads' field, of half the breadth of a spread cell and its depth,
/// beyond which forces act, whatever the forces of this cell are: each by the likelihood of random forces there,
/// the likeliest first, the others beside it. With the pieces next to them, as no cell ends where a piece does. None
/// is named by chance in 10 000 cells.
/// @param data  with the motions that are allowed for so far
std::vector<Polygon> neighbours_beyond_border(const LinearData& data, const Cell& cell, const Gel& gel);

/// "upper left", "left": where these lie, seen from the field of the beads.
std::vector<std::string> borders_of(const std::vector<Polygon>& pieces_um, const std::vector<Vec2>& beads_um);

}  // namespace mbtfm::tensions
