#include "pipeline/contract/cell.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mbtfm {

int n_held_ends(FibreType type) { return type == FibreType::arc ? 0 : type == FibreType::dorsal ? 1 : 2; }

double area_stood_for_um2(const Adhesion& adhesion) {
  // a disc that touches its six neighbours covers pi / sqrt(12) of its cell
  constexpr double kCellOverDisc = 1.1026577908435840990;
  return adhesion.origin == AdhesionOrigin::candidate ? kCellOverDisc * adhesion.area_um2 : adhesion.area_um2;
}

Polygon ellipse_corners(const Adhesion& adhesion, int n_corners, double margin_um) {
  const Vec2 along{std::cos(adhesion.angle_rad), std::sin(adhesion.angle_rad)};
  const Vec2 across{-along.y, along.x};
  Polygon corners;
  for (int i = 0; i < n_corners; ++i) {
    const double phi = 2 * std::numbers::pi * i / n_corners;
    corners.push_back(adhesion.position_um + (0.5 * adhesion.major_axis_um + margin_um) * std::cos(phi) * along +
                      (0.5 * adhesion.minor_axis_um + margin_um) * std::sin(phi) * across);
  }
  return corners;
}

bool covers(const Adhesion& adhesion, Vec2 point_um, double margin_um) {
  const Vec2 offset = point_um - adhesion.position_um;
  const Vec2 axis = {std::cos(adhesion.angle_rad), std::sin(adhesion.angle_rad)};
  const double along = dot(offset, axis) / (0.5 * adhesion.major_axis_um + margin_um);
  const double across = cross(axis, offset) / (0.5 * adhesion.minor_axis_um + margin_um);
  return along * along + across * across <= 1;
}

Cuts cuts_of(const Cell& cell) {
  Cuts cuts;
  const std::size_t n = cell.outline_um.size();
  for (std::size_t i = 0; i < cell.is_cut.size(); ++i)
    if (cell.is_cut[i]) cuts.emplace_back(cell.outline_um[i], cell.outline_um[(i + 1) % n]);
  return cuts;
}

double distance_to_cut_um(const Cell& cell, Vec2 point) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [a, b] : cuts_of(cell)) least = std::min(least, distance_to_segment_um(point, a, b));
  return least;
}

double distance_to_edge_um(const Cell& cell, Vec2 point) {
  double least = distance_to_boundary_um(cell.outline_um, point);
  for (const Polygon& hole : cell.holes_um) least = std::min(least, distance_to_boundary_um(hole, point));
  return least;
}

}  // namespace mbtfm
