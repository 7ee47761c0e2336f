/// The outline of the cell.
#pragma once

#include <vector>

#include "pipeline/contract/parameters.h"
#include "pipeline/contract/types.h"
#include "segment/image.h"

namespace mbtfm::segment {

struct OutlineParameters {
  double outline_smoothing_um = 0.3;  ///< just above the resolution of light: more would round the cell's corners
  double outline_band_um = 3;         ///< brightness inside and outside is compared within this distance
  double outline_reach_um = 3;        ///< an adhesion up to this far outside is still this cell's
  double outline_spacing_um = 0.5;    ///< of the polygon's points
  double outline_smallest_um2 = 50;   ///< less is debris, not a spread cell
};

void declare(ParameterList& list, OutlineParameters& parameters);

/// The largest cell's closed outline, without holes, so that it contains the adhesions.
///
/// A first mask by Otsu's threshold of the smoothed image's logarithm above the darkest region; then each point near
/// the edge is put to the side, inside or outside, whose mean brightness nearby it resembles more (localised Chan–Vese,
/// Lankton & Tannenbaum 2008), which follows uneven light and background. Adhesions within the reach are added.
/// @returns the polygon; empty where there is no cell (constant or noise)
Polygon find_outline(const Image& image, const std::vector<Adhesion>& adhesions, double pixel_size_um,
                     const OutlineParameters& parameters);

/// The adhesions whose centre the outline contains, with their ids renewed.
std::vector<Adhesion> inside(const Polygon& outline_um, const std::vector<Adhesion>& adhesions);

}  // namespace mbtfm::segment
