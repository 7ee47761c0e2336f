/// The pixels of each adhesion. Internal to segment/ (OpenCV types).
#pragma once

#include <vector>

#include "segment/cells/adhesion_contrast.h"
#include "segment/cells/ellipse.h"

namespace mbtfm::cells {

/// Everything above its rim that reaches a seed: hysteresis, split where adhesions touch, the rim of each at a share of
/// its own height.
std::vector<std::vector<CoveredPixel>> adhesion_parts(const Contrast& contrast, double pixel_size_um,
                                                      const AdhesionParameters& parameters);

}  // namespace mbtfm::cells
