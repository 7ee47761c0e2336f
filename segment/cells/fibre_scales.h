/// A fibre's lengths in pixels of the grid it is looked for on. Internal to segment/ (OpenCV types).
#pragma once

#include "segment/cells/fibres.h"
#include "segment/cells/ridge.h"
#include "segment/cells/trace.h"

namespace mbtfm::cells {

/// How many pixels of the image become one of the grid: the narrow filter's deviation spans 1.2 of them, so that the
/// grid carries all but 1e-3 of its spectrum.
int grid_factor(const FibreParameters& parameters, double pixel_um);
/// The filter is narrower than a fibre: it tells neighbours of a bundle apart, and still answers at the crest of a wide
/// one.
RidgeScales scales_of(const FibreParameters& parameters, double pixel_um);
TraceRule rule_of(const FibreParameters& parameters, double pixel_um);
/// Over this length of a line its responses are one independent piece.
double independent_px(const FibreParameters& parameters, double pixel_um);

}  // namespace mbtfm::cells
