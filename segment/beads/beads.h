/// Inside of the bead tracker: bright spots of a known size.
#pragma once

#include "segment/beads/plane.h"
#include "segment/beads/track.h"

namespace mbtfm::beads {

/// Spots of Gaussian sigma `bead_sigma` (px) in an image without its background.
std::vector<DetectedBead> find_spots(const Plane& plane, double bead_sigma, double noise, double detection_snr,
                                     int threads);

/// Spots that are about known, the places and heights of the `wanted` ones (indices) fitted in at most so many rounds,
/// each with the others' pictures taken away.
std::vector<DetectedBead> fitted_spots(const Plane& plane, std::vector<DetectedBead> spots, std::vector<int> wanted,
                                       double bead_sigma, int rounds, int threads);

/// What is as wide as a spot: the difference of two Gaussian averages, which spots are looked for in.
Plane spot_light(const Plane& plane, double bead_sigma);

/// Smoothing width (px) of the background for beads of that size: wide enough to leave a bead 95 % of its height.
double background_sigma(double bead_sigma);

}  // namespace mbtfm::beads
