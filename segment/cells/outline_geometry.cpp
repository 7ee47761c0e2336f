#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "segment/cells/outline.h"

namespace mbtfm::cells {

CutRing cut_by_border(const Polygon& ring_um, Vec2 field_um, double reach_um) {
  constexpr int kLeft = 1, kTop = 2, kRight = 4, kBottom = 8;
  constexpr double kRound = 4;  // of the reach: a ring goes round a corner of the image so near to it
  const std::size_t n = ring_um.size();
  const auto sides_near = [&](Vec2 p) {
    return (p.x <= reach_um ? kLeft : 0) | (p.y <= reach_um ? kTop : 0) | (p.x >= field_um.x - reach_um ? kRight : 0) |
           (p.y >= field_um.y - reach_um ? kBottom : 0);
  };
  const auto put_onto = [&](Vec2& p, int sides) {
    if (sides & kLeft) p.x = 0;
    if (sides & kTop) p.y = 0;
    if (sides & kRight) p.x = field_um.x;
    if (sides & kBottom) p.y = field_um.y;
  };
  std::vector<int> near(n), onto(n, 0);
  for (std::size_t i = 0; i < n; ++i) near[i] = sides_near(ring_um[i]);
  CutRing result;
  std::vector<std::size_t> index;  // of each point in the ring given; n: a corner of the image
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t next = (i + 1) % n;
    const int common = near[i] & near[next];
    Vec2 corner = ring_um[i];
    put_onto(corner, near[i] | near[next]);
    const bool is_round = common == 0 && near[i] != 0 && near[next] != 0 &&
                          std::max(norm(ring_um[i] - corner), norm(ring_um[next] - corner)) <= kRound * reach_um;
    onto[i] |= is_round ? near[i] : common;
    onto[next] |= is_round ? near[next] : common;
    result.points_um.push_back(ring_um[i]);
    result.is_cut.push_back(common != 0 || is_round);
    index.push_back(i);
    if (!is_round) continue;
    result.points_um.push_back(corner);
    result.is_cut.push_back(true);
    index.push_back(n);
  }
  for (std::size_t k = 0; k < index.size(); ++k)
    if (index[k] < n) put_onto(result.points_um[k], onto[index[k]]);
  return result;
}

bool is_in_cell(const CellOutline& cell, Vec2 point_um) {
  const auto is_in = [&](const Polygon& ring) { return contains(ring, point_um); };
  return is_in(cell.outer_um) && std::ranges::none_of(cell.holes_um, is_in);
}

double share_beyond(const CellOutline& cell, const std::vector<CellOutline>& others, double far_um) {
  constexpr double kLines = 100;  // across the cell: its area to a per cent
  const auto [left, right] = std::ranges::minmax(cell.outer_um, {}, &Vec2::x);
  const auto [top, bottom] = std::ranges::minmax(cell.outer_um, {}, &Vec2::y);
  const double step = std::max(right.x - left.x, bottom.y - top.y) / kLines;
  int n = 0, n_beyond = 0;
  for (double y = top.y + step / 2; y < bottom.y; y += step) {
    for (double x = left.x + step / 2; x < right.x; x += step) {
      const Vec2 p{x, y};
      if (!is_in_cell(cell, p)) continue;
      ++n;
      n_beyond += std::ranges::none_of(others, [&](const CellOutline& other) {
        return contains(other.outer_um, p) || distance_to_boundary_um(other.outer_um, p) <= far_um;
      });
    }
  }
  return n == 0 ? 0 : static_cast<double>(n_beyond) / n;
}

std::optional<double> share_beyond_cells(const CellsInImage& seen, const std::vector<Adhesion>& adhesions) {
  constexpr double kBeyond_um = 1;  // channels are shifted by less
  constexpr double kStep_um = 8;    // what is farther from the cell and all of its adhesions is another cell's
  if (seen.cells.empty()) return std::nullopt;
  std::vector<std::size_t> own, others;
  for (std::size_t i = 0; i < adhesions.size(); ++i) (seen.beyond_um[i] <= kStep_um ? own : others).push_back(i);
  for (std::size_t k = 0; k < own.size(); ++k) {  // `own` grows
    const Vec2 at = adhesions[own[k]].position_um;
    const auto joined = std::ranges::stable_partition(
        others, [&](std::size_t i) { return norm(adhesions[i].position_um - at) > kStep_um; });
    own.insert(own.end(), joined.begin(), joined.end());
    others.erase(joined.begin(), joined.end());
  }
  double own_um2 = 0, beyond_um2 = 0;
  for (const std::size_t i : own) {
    own_um2 += adhesions[i].area_um2;
    if (seen.beyond_um[i] > kBeyond_um) beyond_um2 += adhesions[i].area_um2;
  }
  return own_um2 > 0 ? std::optional(beyond_um2 / own_um2) : std::nullopt;
}

double reach_um(const CellOutline& cell, const std::vector<Adhesion>& adhesions) {
  constexpr std::size_t kLeast = 3;
  std::vector<cv::Point2f> points, hull;
  for (const Adhesion& a : adhesions)
    if (is_in_cell(cell, a.position_um)) points.emplace_back(a.position_um.x, a.position_um.y);
  if (points.size() < kLeast) return 0;
  cv::convexHull(points, hull);
  double farthest = 0;
  for (std::size_t i = 0; i < cell.outer_um.size(); ++i)
    if (cell.is_cut.empty() || !cell.is_cut[i])
      farthest =
          std::max(farthest, -cv::pointPolygonTest(hull, cv::Point2f(cell.outer_um[i].x, cell.outer_um[i].y), true));
  return farthest;
}

double reach_um(const CellsInImage& seen, const std::vector<Adhesion>& adhesions) {
  double farthest = 0;
  for (const CellOutline& cell : seen.cells) farthest = std::max(farthest, reach_um(cell, adhesions));
  return farthest;
}

std::vector<Adhesion> inside(const CellOutline& cell, const std::vector<Adhesion>& adhesions) {
  std::vector<Adhesion> kept;
  for (const Adhesion& adhesion : adhesions) {
    if (!is_in_cell(cell, adhesion.position_um)) continue;
    kept.push_back(adhesion);
    kept.back().adhesion_id = static_cast<int>(kept.size());
  }
  return kept;
}

std::vector<Adhesion> inside(const Polygon& outline_um, const std::vector<Adhesion>& adhesions) {
  return inside(CellOutline{outline_um, {}}, adhesions);
}

}  // namespace mbtfm::cells
