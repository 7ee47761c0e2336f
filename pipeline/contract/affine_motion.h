/// A small motion of a whole picture that maps lines to lines.
#pragma once

#include <cmath>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// u = shift + (growth 1 + turn [0 −1; 1 0] + stretch [1 0; 0 −1] + skew [0 1; 1 0]) (x − centre), to first order
struct AffineMotion {
  Vec2 shift;           ///< in the unit of the places: px or um
  double turn_rad = 0;  ///< from +x towards +y
  double growth = 0;    ///< relative
  double stretch = 0;   ///< shear: longer by so much along x, shorter along y
  double skew = 0;      ///< shear: the same along the diagonal x = y and across it
  Vec2 centre;

  Vec2 at(Vec2 place) const {
    const Vec2 d = place - centre;
    return {shift.x + (growth + stretch) * d.x + (skew - turn_rad) * d.y,
            shift.y + (skew + turn_rad) * d.x + (growth - stretch) * d.y};
  }
  double shear() const { return std::hypot(stretch, skew); }
  /// The largest displacement within this distance from the centre, less the shift: of growth, turn and shear the
  /// matrix has singular values |growth + i turn| ± shear.
  double largest_within(double radius) const { return radius * (std::hypot(growth, turn_rad) + shear()); }
};

}  // namespace mbtfm
