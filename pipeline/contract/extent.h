/// The rectangle, along the axes, that holds some places.
#pragma once

#include <algorithm>
#include <functional>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

struct Extent {
  Vec2 low_um, high_um;
  Vec2 middle_um() const { return 0.5 * (low_um + high_um); }
  double area_um2() const { return (high_um.x - low_um.x) * (high_um.y - low_um.y); }
};

/// Of no places: all zero.
/// @param place  of each: a Vec2, or a Vec3 that is seen from above
template <class Things, class Place = std::identity>
Extent extent_of(const Things& things, Place place = {}) {
  Extent extent;
  const auto& [low, high] = extent;
  bool is_first = true;
  for (const auto& thing : things) {
    const auto& p = std::invoke(place, thing);
    if (is_first) extent = {{p.x, p.y}, {p.x, p.y}};
    is_first = false;
    extent = {{std::min(low.x, p.x), std::min(low.y, p.y)}, {std::max(high.x, p.x), std::max(high.y, p.y)}};
  }
  return extent;
}

}  // namespace mbtfm
