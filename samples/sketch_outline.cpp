#include <algorithm>
#include <cmath>
#include <numbers>

#include "samples/geometry.h"
#include "samples/sketch.h"

namespace mbtfm::samples {

namespace {

/// Width over which a cell's corner is rounded: about a focal adhesion's length.
constexpr double kCornerRadius_um = 1.2;

/// Corners around the centre, on an ellipse, with jitter in radius and angle.
std::vector<Vec2> corners_of(const Sketch& sketch, Random& random) {
  const CellParameters& p = sketch.parameters;
  const Vec2 long_axis = direction(random.uniform(0, std::numbers::pi));
  const double first = random.uniform(0, 2 * std::numbers::pi);
  std::vector<Vec2> corners;
  for (int i = 0; i < p.n_corners; ++i) {
    const double angle = first + 2 * std::numbers::pi * (i + 0.25 * random.uniform(-1, 1)) / p.n_corners;
    const double jitter = std::clamp(random.normal(), -2.0, 2.0) * p.corner_jitter;
    const Vec2 on_circle = (0.5 * p.diameter_um * (1 + jitter)) * direction(angle);
    const double along = dot(on_circle, long_axis);
    const double stretch = std::sqrt(p.elongation);
    corners.push_back(sketch.centre_um + (along * stretch) * long_axis +
                      (1 / stretch) * (on_circle - along * long_axis));
  }
  return corners;
}

int nearest_point(const Polygon& outline, Vec2 point) {
  const auto nearer = [&](Vec2 a, Vec2 b) { return norm(a - point) < norm(b - point); };
  return static_cast<int>(std::ranges::min_element(outline, nearer) - outline.begin());
}

}  // namespace

Vec2 inward_normal(const Sketch& sketch, int i) {
  const int n = static_cast<int>(sketch.outline_um.size());
  // the outline turns from +x towards +y, so that the inside lies to the left of its direction
  return left_of(unit(sketch.outline_um[(i + 1) % n] - sketch.outline_um[(i + n - 1) % n]));
}

void draw_outline(Sketch& sketch, Random& random) {
  const std::vector<Vec2> corners = corners_of(sketch, random);
  Polygon outline;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec2 a = corners[i];
    const Vec2 b = corners[(i + 1) % corners.size()];
    const double concavity = sketch.parameters.edge_concavity * random.uniform(0.3, 1.7);
    Polyline edge = parabola(a, b, concavity * norm(b - a), kOutlineSpacing_um);
    outline.insert(outline.end(), edge.begin(), edge.end() - 1);
  }
  outline = smoothed_closed(resampled_closed(outline, kOutlineSpacing_um), kCornerRadius_um);
  sketch.outline_um = resampled_closed(outline, kOutlineSpacing_um);
  for (const Vec2 corner : corners) sketch.corner_points.push_back(nearest_point(sketch.outline_um, corner));
}

}  // namespace mbtfm::samples
