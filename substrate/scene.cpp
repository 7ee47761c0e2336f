#include "substrate/scene.h"

#include <algorithm>
#include <limits>

#include "pipeline/contract/errors.h"
#include "substrate/ellipse_load.h"

namespace mbtfm::substrate {

Extent extent_of(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses) {
  if (points_um.empty() && ellipses.empty()) throw InvalidData("scene", "points or ellipses", "none");
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Extent extent{{kFar, kFar}, {-kFar, -kFar}};
  const auto include = [&extent](Vec2 low, Vec2 high) {
    extent.low_um = {std::min(extent.low_um.x, low.x), std::min(extent.low_um.y, low.y)};
    extent.high_um = {std::max(extent.high_um.x, high.x), std::max(extent.high_um.y, high.y)};
  };
  for (const Vec2 point : points_um) include(point, point);
  for (const Ellipse& ellipse : ellipses) {
    const Vec2 half = half_extent_um(ellipse);
    include(ellipse.centre_um - half, ellipse.centre_um + half);
  }
  return extent;
}

}  // namespace mbtfm::substrate
