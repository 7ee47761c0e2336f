/// Inside of the bead tracker: whether both images are equally sharp, and the beads round.
#pragma once

#include "segment/beads/scene.h"

namespace mbtfm::beads {

/// Size of the good beads in both images, from their light in Gaussian windows of one and of two bead sigmas:
///
///   sum A / sum B = R = (s² + s2²) / (s² + s1²),   s² = (s2² − R s1²) / (R − 1)
///
/// A, B: means of a bead's surroundings with the weights of s1 and of s2. Both are linear in the light, so noise moves
/// neither sum, and what lies beside a bead adds the same to both images. The standard error is that of a ratio of sums
/// over beads, each bead's share in both images taken together.
///
/// Their shape, from the means of (x² − y²) I and 2xy I with the weights of s1, which an even background leaves at
/// zero:
///
///   (s_x² − s_y²) = sum Q / sum (A − B) · (s2² − s1²) / (s² + s2²) · (s1² + s²)² / s1⁴
///
/// to first order in the difference; the same with 2xy for the diagonal directions (Gaussian-weighted moments as of
/// Kaiser, Squires & Broadhurst, ApJ 449:460, 1995).
BeadSizes sizes_of(const Scene& scene, const std::vector<Track>& tracks);

}  // namespace mbtfm::beads
