/// Inside of the bead tracker: bright spots of a known size.
#pragma once

#include "segment/plane.h"
#include "segment/track.h"

namespace mbtfm::segment {

/// Spots of Gaussian sigma `bead_sigma` (px) in an image without its background.
std::vector<DetectedBead> find_spots(const Plane& plane, double bead_sigma, double noise, double detection_snr,
                                     int threads);

/// Smoothing width (px) of the background for beads of that size: wide enough to leave a bead 95 % of its height.
double background_sigma(double bead_sigma);

}  // namespace mbtfm::segment
