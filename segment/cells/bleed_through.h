/// Does the adhesion image show the actin, too? Filters let a part of one dye's light through to the other's image.
#pragma once

#include <optional>

#include "pipeline/contract/cell.h"
#include "segment/images/image.h"

namespace mbtfm::cells {

/// Contrast of the cell's fibres in the adhesion image, over that of its adhesions. A contrast is the brightness on an
/// object less the mean of both sides of it, 0.5 um beyond its width; of adhesions their middle one, across their minor
/// axis; of fibres the middle one of all their points, a fifth of a micrometre apart, but for 3 um at each end.
/// @returns nothing of a cell without adhesions, or with less than 10 um of such fibre
std::optional<double> contrast_of_fibres(const images::Image& adhesion, const Cell& cell, double pixel_um);

}  // namespace mbtfm::cells
