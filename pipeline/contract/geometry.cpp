#include "pipeline/contract/geometry.h"

#include <algorithm>
#include <limits>

namespace mbtfm {

double length_um(const Polyline& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += norm(points[i] - points[i - 1]);
  return length;
}

double nearest_share(Vec2 a, Vec2 b, Vec2 point) {
  const Vec2 step = b - a;
  const double squared = dot(step, step);
  return squared > 0 ? std::clamp(dot(point - a, step) / squared, 0.0, 1.0) : 0.0;
}

double distance_to_segment_um(Vec2 point_um, Vec2 a_um, Vec2 b_um) {
  return norm(point_um - (a_um + nearest_share(a_um, b_um, point_um) * (b_um - a_um)));
}

double signed_area_um2(const Polygon& polygon) {
  double doubled = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) doubled += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return 0.5 * doubled;
}

bool contains(const Polygon& polygon, Vec2 point) {
  bool is_inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i];
    const Vec2 b = polygon[(i + 1) % polygon.size()];
    if ((a.y > point.y) == (b.y > point.y)) continue;
    if (point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y)) is_inside = !is_inside;
  }
  return is_inside;
}

Vec2 nearest_on_boundary_um(const Polygon& polygon, Vec2 point) {
  Vec2 nearest;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i];
    const Vec2 b = polygon[(i + 1) % polygon.size()];
    const Vec2 candidate = a + nearest_share(a, b, point) * (b - a);
    const Vec2 away = point - candidate;
    if (const double squared = dot(away, away); squared < smallest) {
      smallest = squared;
      nearest = candidate;
    }
  }
  return nearest;
}

double distance_to_boundary_um(const Polygon& polygon, Vec2 point) {
  return norm(point - nearest_on_boundary_um(polygon, point));
}

}  // namespace mbtfm
