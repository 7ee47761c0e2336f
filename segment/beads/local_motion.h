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

/// What is fitted: an affine motion, or one with second derivatives, too, where those that a field has exceed its
/// noise.
enum class Order { affine, curved };

/// Motion through the `others` around `place`, nearer ones weighing more, outliers (over 2.5 spreads) less;
/// their mean where there are fewer than six, an affine one where fewer than twelve. Nothing where there is none.
std::optional<LocalMotion> local_motion(Vec2 place, const std::vector<int>& others, const std::vector<Vec2>& positions,
                                        const std::vector<Motion>& motions, Order order = Order::affine);

}  // namespace mbtfm::beads
