/// The rectangle, along the axes, that holds some places.
#pragma once

#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

struct Extent {
  Vec2 low_um, high_um;
  Vec2 middle_um() const { return 0.5 * (low_um + high_um); }
  double area_um2() const { return (high_um.x - low_um.x) * (high_um.y - low_um.y); }
};
/// Of no places: all zero.
Extent extent_of(const std::vector<Vec2>& places_um);

}  // namespace mbtfm
