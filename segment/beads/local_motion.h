/// Inside of the bead tracker: what the beads around a place say of its motion.
#pragma once

#include <optional>

#include "segment/beads/registration.h"

namespace mbtfm::beads {

struct LocalMotion {
  Motion motion;
  double spread_px = 0;    ///< robust standard deviation of a component about the fit
  double reach_px = 0;     ///< distance of the furthest bead used
  double noise_share = 1;  ///< variance of the motion's u over that of a bead's, for equal and independent errors
  int n_beads = 0;
};

/// Affine motion through the `others` around `place`, nearer ones weighing more, outliers (over 2.5 spreads) less;
/// their mean where there are fewer than six. Nothing where there is none.
std::optional<LocalMotion> local_motion(Vec2 place, const std::vector<int>& others, const std::vector<Vec2>& positions,
                                        const std::vector<Motion>& motions);

}  // namespace mbtfm::beads
