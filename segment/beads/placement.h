/// Inside of the bead tracker: where the places of the relaxed picture are in another one.
#pragma once

#include <cmath>
#include <optional>

#include "pipeline/contract/affine_motion.h"

namespace mbtfm::beads {

/// A vector turned from +x towards +y.
inline Vec2 rotated(Vec2 v, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {c * v.x - s * v.y, s * v.x + c * v.y};
}

/// A turn about the image's centre, then a shift.
struct Turn {
  double angle_rad = 0;  ///< from +x towards +y
  Vec2 shift, centre;
  Vec2 of(Vec2 place) const { return centre + shift + rotated(place - centre, angle_rad); }
  Vec2 back(Vec2 place) const { return centre + rotated(place - centre - shift, -angle_rad); }
};

/// From the relaxed picture to another one in which the gel is at rest; px. By default both are the same.
struct Placement {
  AffineMotion motion = {};       ///< of the stage, after the other picture was turned back
  std::optional<Turn> turn = {};  ///< by which it was turned back

  Vec2 of(Vec2 place) const {
    const Vec2 moved = place + motion.at(place);
    return turn ? turn->of(moved) : moved;
  }
  double turn_rad() const { return motion.turn_rad + (turn ? turn->angle_rad : 0); }
};

}  // namespace mbtfm::beads
