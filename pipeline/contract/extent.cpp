#include "pipeline/contract/extent.h"

#include <algorithm>

namespace mbtfm {

Extent extent_of(const std::vector<Vec2>& places_um) {
  if (places_um.empty()) return {};
  Extent extent{places_um.front(), places_um.front()};
  for (const Vec2 p : places_um) {
    extent.low_um = {std::min(extent.low_um.x, p.x), std::min(extent.low_um.y, p.y)};
    extent.high_um = {std::max(extent.high_um.x, p.x), std::max(extent.high_um.y, p.y)};
  }
  return extent;
}

}  // namespace mbtfm
