/// Boxes that labels and marks take, which the next label keeps clear of.
#pragma once

#include "pipeline/contract/geometry.h"

namespace mbtfm::charts {

struct Box {
  Vec2 low, high;
};

inline Box box_around(Vec2 centre, double width, double height) {
  const Vec2 half = 0.5 * Vec2{width, height};
  return {centre - half, centre + half};
}

inline bool overlap(const Box& a, const Box& b) {
  return a.low.x < b.high.x && b.low.x < a.high.x && a.low.y < b.high.y && b.low.y < a.high.y;
}

}  // namespace mbtfm::charts
