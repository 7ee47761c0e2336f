#include "segment/cells/fibre_line.h"

#include <algorithm>
#include <cmath>

namespace mbtfm::cells {
namespace {

/// Between first and last, both kept.
void simplify(const Polyline& line, std::size_t first, std::size_t last, double tolerance_um, Polyline& kept) {
  const Vec2 d = line[last] - line[first];
  const double l = norm(d);
  std::size_t farthest = first;
  double greatest = tolerance_um;
  for (std::size_t i = first + 1; i < last; ++i) {
    const Vec2 r = line[i] - line[first];
    const double distance = l > 0 ? std::abs(cross(d, r)) / l : norm(r);
    if (distance > greatest) greatest = distance, farthest = i;
  }
  if (farthest != first) {
    simplify(line, first, farthest, tolerance_um, kept);
    simplify(line, farthest, last, tolerance_um, kept);
  } else {
    kept.push_back(line[last]);
  }
}

/// Does the line run along the outline at this point?
bool hugs(const Polygon& outline_um, Vec2 point, Vec2 along, double distance_um) {
  if (!contains(outline_um, point)) return true;
  const Vec2 away = point - nearest_on_boundary_um(outline_um, point);
  constexpr double kParallel = 0.5;  // sine of 30°
  return norm(away) < distance_um && std::abs(dot(away, along)) <= kParallel * norm(away) * norm(along);
}

}  // namespace

std::vector<cv::Point2d> smoothed(const std::vector<cv::Point2d>& points, int half_window) {
  const int n = static_cast<int>(points.size());
  std::vector<cv::Point2d> result(points.size());
  for (int i = 0; i < n; ++i) {
    const int h = std::min({half_window, i, n - 1 - i});
    cv::Point2d sum(0, 0);
    for (int k = i - h; k <= i + h; ++k) sum += points[k];
    result[i] = sum / (2 * h + 1);
  }
  return result;
}

Piece without_edge(const Polyline& line, const Polygon& outline_um, double distance_um) {
  if (outline_um.empty()) return {0, line.size()};
  Piece best;
  std::size_t first = 0;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    const std::size_t a = i > 2 ? i - 3 : 0, b = std::min(i + 3, line.size() - 1);
    if (i < line.size() && !hugs(outline_um, line[i], line[b] - line[a], distance_um)) continue;
    if (i - first > best.n) best = {first, i - first};
    first = i + 1;
  }
  return best;
}

Polyline simplified(const Polyline& line, double tolerance_um) {
  Polyline kept{line.front()};
  simplify(line, 0, line.size() - 1, tolerance_um, kept);
  return kept;
}

}  // namespace mbtfm::cells
