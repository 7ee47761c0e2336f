#include "substrate/scene.h"

#include <algorithm>
#include <limits>

#include "pipeline/contract/errors.h"
#include "substrate/ellipse.h"

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

void check_size(const Extent& scene, double step_um, std::int64_t most_elements) {
  const Vec2 size = scene.high_um - scene.low_um;
  const double n = (1 + size.x / step_um) * (1 + size.y / step_um);
  if (n <= static_cast<double>(most_elements)) return;
  throw OutOfMemory("the gel is so thin beside the scene that it takes more than " + std::to_string(most_elements) +
                    " elements, the most that the memory allowed takes: take the model 'layer'");
}

}  // namespace mbtfm::substrate
