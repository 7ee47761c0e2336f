#include "network/mesh/adhesions.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/polyline.h"
#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::mesh {
namespace {

constexpr int kCornersOfEllipse = 256;  // perimeter and area to 1e-4
constexpr int kPointsPerEdge = 4;       // of the fine line that fibres cross, a sixteenth of an edge off at most
constexpr double kNearRim = 0.25;       // nearer to the boundary (in edges) the boundary itself is the rim

enum class Side { kept, outside, covered };

Side side_of(Vec2 point, const std::vector<Adhesion>& others, const Boundary& boundary, double edge_um) {
  const BoundaryPlace place = boundary.place(point);
  if (!place.is_inside || place.distance_um < kNearRim * edge_um) return Side::outside;
  const bool is_covered =
      std::any_of(others.begin(), others.end(), [&](const Adhesion& other) { return covers(other, point); });
  return is_covered ? Side::covered : Side::kept;
}

}  // namespace

std::pair<std::vector<Adhesion>, std::vector<int>> separated(std::vector<Adhesion> adhesions, const SizeField& size,
                                                             double distance) {
  std::vector<int> moved;
  const double widest = distance * size.edge_um();
  std::vector<Vec2> positions;
  for (const Adhesion& a : adhesions) positions.push_back(a.position_um);
  constexpr int kSweeps = 20;
  bool has_changed = true;
  for (int sweep = 0; sweep < kSweeps && has_changed; ++sweep) {
    has_changed = false;
    numerics::Grid before(positions, widest);  // those that come first
    for (int i = 0; i < static_cast<int>(positions.size()); ++i) {
      const double wanted = distance * size.at(positions[i]);
      before.for_each_near(positions[i], positions[i], widest, [&](int j) {
        const Vec2 gap = positions[i] - positions[j];
        const double length = norm(gap);
        if (length >= wanted) return;
        const double angle = adhesions[j].angle_rad;  // along the one that came first, where there is no direction
        const Vec2 direction = length > 1e-6 * wanted ? (1 / length) * gap : Vec2{std::cos(angle), std::sin(angle)};
        const Vec2 shift = (0.505 * (wanted - length)) * direction;  // a little too far, so that it ends
        positions[i] += shift;
        positions[j] += -1.0 * shift;
        moved.push_back(adhesions[i].adhesion_id);
        moved.push_back(adhesions[j].adhesion_id);
        has_changed = true;
      });
      before.add(i, positions[i], positions[i]);
    }
  }
  for (std::size_t i = 0; i < positions.size(); ++i) adhesions[i].position_um = positions[i];
  std::sort(moved.begin(), moved.end());
  moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
  return {std::move(adhesions), std::move(moved)};
}

double perimeter_um(const Adhesion& adhesion) {
  Polygon corners = ellipse_corners(adhesion, kCornersOfEllipse);
  corners.push_back(corners.front());
  return length_um(corners);
}

Polygon rim_um(const Adhesion& adhesion, double edge_um) {
  Polygon corners = ellipse_corners(adhesion, kCornersOfEllipse);
  const int n_edges = std::max(3, static_cast<int>(std::lround(perimeter_um(adhesion) / edge_um)));
  // chords cut area off the ellipse: an eighth and more where it is long
  const double drawn_um2 = std::abs(signed_area_um2(evenly_resampled(corners, n_edges)));
  const double stretch = std::sqrt(std::abs(signed_area_um2(corners)) / drawn_um2);
  for (Vec2& p : corners) p = adhesion.position_um + stretch * (p - adhesion.position_um);
  return evenly_resampled(corners, kPointsPerEdge * std::max(8, n_edges));
}

std::vector<RimPart> free_rim(const Adhesion& adhesion, const std::vector<Adhesion>& others, const Boundary& boundary,
                              double edge_um) {
  const Polygon rim = rim_um(adhesion, edge_um);
  const int n = static_cast<int>(rim.size());
  std::vector<Side> sides;
  for (const Vec2 p : rim) sides.push_back(side_of(p, others, boundary, edge_um));
  const auto gap = std::find_if(sides.begin(), sides.end(), [](Side s) { return s != Side::kept; });
  if (gap == sides.end()) return {{rim, true}};
  const auto boundary_point = [&](int i) {
    const BoundaryPlace place = boundary.place(rim[i]);
    return boundary.rings()[place.ring].at(place.s_um);
  };
  std::vector<RimPart> parts;
  const int start = static_cast<int>(gap - sides.begin());
  for (int k = start; k < start + n;) {
    if (sides[k % n] != Side::kept) {
      ++k;
      continue;
    }
    RimPart part;
    if (sides[(k + n - 1) % n] == Side::outside) part.points_um.push_back(boundary_point((k + n - 1) % n));
    for (; sides[k % n] == Side::kept; ++k) part.points_um.push_back(rim[k % n]);
    if (sides[k % n] == Side::outside) part.points_um.push_back(boundary_point(k % n));
    if (length_um(part.points_um) > 0.5 * edge_um) parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace mbtfm::mesh
