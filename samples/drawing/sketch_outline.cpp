#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include "samples/drawing/geometry.h"
#include "samples/drawing/sketch.h"

namespace mbtfm::drawing {

namespace {

/// Width over which a cell's corner is rounded: about a focal adhesion's length.
constexpr double kCornerRadius_um = 1.2;
// depth of the arc between two corners over their distance, where an edge bundle draws it in
constexpr double kFreeEdgeConcavity = 0.13;

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

namespace {

/// Which of the arcs between corners are free edges: the longest, no two of them neighbours.
std::vector<bool> free_arcs(const std::vector<Vec2>& corners, int n_free) {
  const std::size_t n = corners.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, std::greater{}, [&](std::size_t i) { return norm(corners[(i + 1) % n] - corners[i]); });
  std::vector<bool> is_free(n, false);
  for (const std::size_t i : order) {
    if (n_free == 0) break;
    if (is_free[(i + 1) % n] || is_free[(i + n - 1) % n]) continue;
    is_free[i] = true;
    --n_free;
  }
  return is_free;
}

/// Move the points across the outline, by lobes and by the tents of filopodia; free edges are smooth.
void roughen(Sketch& sketch, Random& random) {
  const int n = static_cast<int>(sketch.outline_um.size());
  const auto noise_of = [&](double sigma_um) {
    Polygon noise(n);
    for (Vec2& v : noise) v.x = random.normal();
    // white noise after a Gaussian of s points has the standard deviation 1 / sqrt(2 sqrt(pi) s) of before
    const double gain = std::sqrt(2 * std::sqrt(std::numbers::pi) * sigma_um / kOutlineSpacing_um);
    std::vector<double> values(n);
    const int reach = static_cast<int>(4 * sigma_um / kOutlineSpacing_um);
    for (int i = 0; i < n; ++i) {
      double sum = 0, weights = 0;
      for (int k = -reach; k <= reach; ++k) {
        const double weight = std::exp(-0.5 * std::pow(k * kOutlineSpacing_um / sigma_um, 2));
        sum += weight * noise[((i + k) % n + n) % n].x;
        weights += weight;
      }
      values[i] = gain * sum / weights;
    }
    return values;
  };
  const std::vector<double> lobes = noise_of(2.5), tents = noise_of(0.7);
  Polygon moved = sketch.outline_um;
  for (int i = 0; i < n; ++i) {
    const bool is_free = std::ranges::any_of(
        sketch.free_edges, [&](const FreeEdge& e) { return (i - e.first + n) % n <= (e.last - e.first + n) % n; });
    if (is_free) continue;
    const double shift = sketch.parameters.edge_roughness_um * (0.8 * lobes[i] + 0.6 * tents[i]);
    moved[i] += std::clamp(shift, -3 * sketch.parameters.edge_roughness_um, 3 * sketch.parameters.edge_roughness_um) *
                inward_normal(sketch, i);
  }
  sketch.outline_um = std::move(moved);
}

}  // namespace

void draw_outline(Sketch& sketch, Random& random) {
  const CellParameters& p = sketch.parameters;
  const std::vector<Vec2> corners = corners_of(sketch, random);
  const std::vector<bool> is_free = free_arcs(corners, p.n_edge);
  Polygon outline;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec2 a = corners[i];
    const Vec2 b = corners[(i + 1) % corners.size()];
    const double deviate = random.uniform(0.3, 1.7);
    const double concavity = is_free[i] ? kFreeEdgeConcavity * (0.7 + 0.3 * deviate) : p.edge_concavity * deviate;
    Polyline edge = parabola(a, b, concavity * norm(b - a), kOutlineSpacing_um);
    outline.insert(outline.end(), edge.begin(), edge.end() - 1);
  }
  outline = smoothed_closed(resampled_closed(outline, kOutlineSpacing_um), kCornerRadius_um);
  sketch.outline_um = resampled_closed(outline, kOutlineSpacing_um);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    sketch.corner_points.push_back(nearest_point(sketch.outline_um, corners[i]));
    if (is_free[i])
      sketch.free_edges.push_back(
          {sketch.corner_points.back(), nearest_point(sketch.outline_um, corners[(i + 1) % corners.size()])});
  }
  if (p.edge_roughness_um > 0) roughen(sketch, random);
}

}  // namespace mbtfm::drawing
