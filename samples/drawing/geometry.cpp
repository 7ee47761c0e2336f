#include "samples/drawing/geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbtfm::drawing {

Polyline resampled(const Polyline& line, double spacing_um) {
  const double total = length_um(line);
  const int n_pieces = std::max(1, static_cast<int>(std::lround(total / spacing_um)));
  Polyline result{line.front()};
  std::size_t segment = 1;
  double before = 0;  // arc length at the start of the segment
  for (int i = 1; i < n_pieces; ++i) {
    const double target = total * i / n_pieces;
    double length = norm(line[segment] - line[segment - 1]);
    while (before + length < target && segment + 1 < line.size()) {
      before += length;
      ++segment;
      length = norm(line[segment] - line[segment - 1]);
    }
    result.push_back(line[segment - 1] + ((target - before) / length) * (line[segment] - line[segment - 1]));
  }
  result.push_back(line.back());
  return result;
}

Polygon resampled_closed(const Polygon& polygon, double spacing_um) {
  Polyline line = polygon;
  line.push_back(polygon.front());
  Polygon result = resampled(line, spacing_um);
  result.pop_back();
  return result;
}

Polygon smoothed_closed(const Polygon& polygon, double sigma_um) {
  const int n = static_cast<int>(polygon.size());
  Polyline closed = polygon;
  closed.push_back(polygon.front());
  const double spacing = length_um(closed) / n;
  const int reach = std::min(n / 2, static_cast<int>(std::ceil(4 * sigma_um / spacing)));
  Polygon result(polygon.size());
  for (int i = 0; i < n; ++i) {
    Vec2 sum;
    double weights = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double weight = std::exp(-0.5 * std::pow(k * spacing / sigma_um, 2));
      sum += weight * polygon[((i + k) % n + n) % n];
      weights += weight;
    }
    result[i] = (1 / weights) * sum;
  }
  return result;
}

Vec2 tangent(const Polyline& line, std::size_t i) {
  const std::size_t before = i == 0 ? 0 : i - 1;
  const std::size_t after = std::min(i + 1, line.size() - 1);
  return unit(line[after] - line[before]);
}

Polyline parabola(Vec2 a, Vec2 b, double sag_um, double spacing_um) {
  const Vec2 normal = left_of(unit(b - a));
  Polyline fine;
  constexpr int n = 64;
  for (int i = 0; i <= n; ++i) {
    const double s = static_cast<double>(i) / n;
    fine.push_back(a + s * (b - a) + (4 * s * (1 - s) * sag_um) * normal);
  }
  return resampled(fine, spacing_um);
}

bool too_near(const Adhesion& a, const Adhesion& b, double clearance_um) {
  const double reach = 0.5 * (a.major_axis_um + b.major_axis_um) + clearance_um;
  if (norm(a.position_um - b.position_um) > reach) return false;
  const auto is_covered = [&](const Adhesion& by, const Adhesion& other) {
    if (covers(by, other.position_um, clearance_um)) return true;
    return std::ranges::any_of(ellipse_corners(other, 24), [&](Vec2 p) { return covers(by, p, clearance_um); });
  };
  return is_covered(a, b) || is_covered(b, a);
}

Adhesion make_adhesion(Vec2 position_um, double area_um2, double aspect, double angle_rad) {
  Adhesion a;
  a.position_um = position_um;
  a.area_um2 = area_um2;
  a.minor_axis_um = 2 * std::sqrt(area_um2 / (std::numbers::pi * aspect));
  a.major_axis_um = aspect * a.minor_axis_um;
  a.angle_rad = std::remainder(angle_rad, std::numbers::pi);
  a.eccentricity = std::sqrt(1 - 1 / (aspect * aspect));
  return a;
}

}  // namespace mbtfm::drawing
