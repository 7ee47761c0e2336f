/// Segmented cells at random: any outline, adhesions and fibres a segmentation may give, valid by `check`.
#pragma once

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct RandomCellOptions {
  double radius_um = 20;
  int n_adhesions = 60;  ///< at most, where a least distance is wanted
  int n_fibres = 12;
  double roughness = 0.25;  ///< of the outline: relative deviation from a circle; above 0.3 with deep bays
  int n_outline_points = 200;
  double pixel_um = 0;           ///< > 0: the outline takes the steps of pixels of this size
  double curvature = 0.1;        ///< of fibres: sagitta over length
  double least_distance_um = 0;  ///< between adhesions
};

inline double uniform(std::mt19937_64& engine, double low, double high) {
  return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
}

/// A star-shaped outline: a circle with waves of two to six periods.
inline Polygon random_outline(std::mt19937_64& engine, const RandomCellOptions& options) {
  std::vector<std::pair<double, double>> waves;  // amplitude, phase
  for (int k = 2; k <= 6; ++k)
    waves.push_back({options.roughness * uniform(engine, 0, 1.5) / k, uniform(engine, 0, 2 * std::numbers::pi)});
  Polygon outline;
  for (int i = 0; i < options.n_outline_points; ++i) {
    const double angle = 2 * std::numbers::pi * i / options.n_outline_points;
    double radius = options.radius_um;
    for (std::size_t k = 0; k < waves.size(); ++k)
      radius += options.radius_um * waves[k].first * std::cos(static_cast<double>(k + 2) * angle + waves[k].second);
    radius = std::max(radius, 0.15 * options.radius_um);
    outline.push_back({30 + radius * std::cos(angle), 30 + radius * std::sin(angle)});
  }
  if (options.pixel_um <= 0) return outline;
  Polygon stepped;  // along x, then along y, from pixel corner to pixel corner
  const auto add = [&](Vec2 p) {
    if (stepped.empty() || !(stepped.back() == p)) stepped.push_back(p);
  };
  for (const Vec2 p : outline) {
    const Vec2 corner = {std::round(p.x / options.pixel_um) * options.pixel_um,
                         std::round(p.y / options.pixel_um) * options.pixel_um};
    if (!stepped.empty()) add({corner.x, stepped.back().y});
    add(corner);
  }
  return stepped;
}

inline Vec2 random_inside(std::mt19937_64& engine, const Polygon& outline, double reach_um) {
  for (;;) {
    const Vec2 p = {30 + uniform(engine, -1, 1) * reach_um, 30 + uniform(engine, -1, 1) * reach_um};
    if (contains(outline, p)) return p;
  }
}

/// A gently bent line from a to b with a point about every 1.2 um.
inline Polyline bent_line(Vec2 a, Vec2 b, double curvature) {
  const Vec2 chord = b - a;
  const Vec2 side = {-chord.y, chord.x};
  const int n = std::max(2, static_cast<int>(norm(chord) / 1.2));
  Polyline line;
  for (int i = 0; i <= n; ++i) {
    const double s = static_cast<double>(i) / n;
    line.push_back(a + s * chord + (4 * curvature * s * (1 - s)) * side);
  }
  return line;
}

inline Cell random_cell(std::uint64_t seed, const RandomCellOptions& options = {}) {
  std::mt19937_64 engine(seed);
  Cell cell;
  cell.outline_um = random_outline(engine, options);
  if (engine() % 2 == 0) std::reverse(cell.outline_um.begin(), cell.outline_um.end());
  const double reach = 2 * options.radius_um;
  for (int i = 0; i < options.n_adhesions; ++i) {
    Adhesion a;
    a.adhesion_id = static_cast<int>(cell.adhesions.size()) + 1;
    a.position_um = random_inside(engine, cell.outline_um, reach);
    if (uniform(engine, 0, 1) < 0.7) {  // most are peripheral
      const Vec2 edge = nearest_on_boundary_um(cell.outline_um, a.position_um);
      a.position_um = edge + uniform(engine, 0, 0.4) * (a.position_um - edge);
    }
    const bool is_crowded = std::any_of(cell.adhesions.begin(), cell.adhesions.end(), [&](const Adhesion& other) {
      return norm(other.position_um - a.position_um) < options.least_distance_um;
    });
    if (is_crowded) continue;
    a.area_um2 = 0.15 * std::pow(10.0, uniform(engine, 0, 1));
    const double ratio = uniform(engine, 1, 4);
    a.minor_axis_um = std::sqrt(4 * a.area_um2 / (std::numbers::pi * ratio));
    a.major_axis_um = ratio * a.minor_axis_um;
    a.angle_rad = uniform(engine, -std::numbers::pi / 2, std::numbers::pi / 2);
    a.eccentricity = std::sqrt(1 - 1 / (ratio * ratio));
    a.mean_intensity = 1;
    cell.adhesions.push_back(a);
  }
  for (int i = 0; i < options.n_fibres; ++i) {
    Fibre f;
    f.fibre_id = i + 1;
    f.width_um = 0.6;
    const int kind = cell.adhesions.size() < 2 ? 2 : i % 3;
    Vec2 a = random_inside(engine, cell.outline_um, reach);
    Vec2 b = random_inside(engine, cell.outline_um, reach);
    if (kind < 2) {
      const Adhesion& start = cell.adhesions[engine() % cell.adhesions.size()];
      a = start.position_um;
      f.start_adhesion_id = start.adhesion_id;
      f.type = FibreType::dorsal;
    }
    if (kind == 0) {
      const Adhesion& end = cell.adhesions[engine() % cell.adhesions.size()];
      if (end.adhesion_id != *f.start_adhesion_id) {
        b = end.position_um;
        f.end_adhesion_id = end.adhesion_id;
        f.type = FibreType::ventral;
      }
    }
    if (norm(b - a) < 3) b = a + (3 / std::max(1e-9, norm(Vec2{30, 30} - a))) * (Vec2{30, 30} - a);
    f.points_um = bent_line(a, b, uniform(engine, -options.curvature, options.curvature));
    f.mean_intensity = 1;
    cell.fibres.push_back(f);
  }
  return cell;
}

}  // namespace mbtfm::test
