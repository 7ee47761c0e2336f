/// Inside of the bead tracker: whether both images are equally sharp.
#pragma once

#include "segment/beads/scene.h"

namespace mbtfm::beads {

struct SizeRatio {
  double ratio = 1;  ///< of the beads' size in the stressed image over that in the relaxed one
  double sigma = 0;  ///< its standard error
};

/// Size of the good beads in both images, from their light in Gaussian windows of one and of two bead sigmas:
///
///   sum A / sum B = R = (s² + s2²) / (s² + s1²),   s² = (s2² − R s1²) / (R − 1)
///
/// A, B: means of a bead's surroundings with the weights of s1 and of s2. Both are linear in the light, so noise moves
/// neither sum, and what lies beside a bead adds the same to both images. The standard error is that of a ratio of sums
/// over beads, each bead's share in both images taken together.
SizeRatio size_ratio(const Scene& scene, const std::vector<Track>& tracks);

}  // namespace mbtfm::beads
