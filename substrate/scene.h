/// Where a scene lies on the surface: what the block of a finite element model has to cover.
#pragma once

#include "substrate/ellipse.h"

namespace mbtfm::substrate {

struct Extent {
  Vec2 low_um, high_um;
};

/// The smallest axis-parallel rectangle around points and ellipses. @throws InvalidData where there are none
Extent extent_of(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses);

}  // namespace mbtfm::substrate
