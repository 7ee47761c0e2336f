#include "network/mesh/outline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "pipeline/contract/polyline.h"

namespace mbtfm::mesh {
namespace {

constexpr int kSamplesPerEdge = 8;  // a sixteenth of an edge off the line at most
constexpr int kHalfWindow = 2;      // averages over five samples, about half an edge
constexpr double kCornerTurn = 50 * std::numbers::pi / 180;

Polygon positively_oriented(Polygon polygon) {
  if (signed_area_um2(polygon) < 0) std::reverse(polygon.begin(), polygon.end());
  return polygon;
}

double turn(const Polygon& points, int i, int reach) {
  const int n = static_cast<int>(points.size());
  const Vec2 before = points[i] - points[(i + n - reach) % n];
  const Vec2 after = points[(i + reach) % n] - points[i];
  return std::abs(std::atan2(cross(before, after), dot(before, after)));
}

std::vector<int> corner_indices(const Polygon& smooth) {
  const int n = static_cast<int>(smooth.size());
  const int reach = kSamplesPerEdge / 2;
  std::vector<double> turns(n);
  for (int i = 0; i < n; ++i) turns[i] = turn(smooth, i, reach);
  std::vector<int> corners;
  for (int i = 0; i < n; ++i) {
    if (turns[i] < kCornerTurn) continue;
    bool is_peak = true;
    for (int k = 1; k <= reach; ++k)
      is_peak = is_peak && turns[i] >= turns[(i + k) % n] && turns[i] > turns[(i + n - k) % n];
    if (is_peak) corners.push_back(i);
  }
  return corners;
}

}  // namespace

OutlineCurve::OutlineCurve(const Polygon& outline_um, double edge_um) {
  const Polygon outline = positively_oriented(outline_um);
  double perimeter = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) perimeter += norm(outline[(i + 1) % outline.size()] - outline[i]);
  const int n = std::max(6 * kSamplesPerEdge, static_cast<int>(std::lround(kSamplesPerEdge * perimeter / edge_um)));
  const Polygon dense = evenly_resampled(outline, n);
  points_um_.resize(n);
  for (int i = 0; i < n; ++i)
    for (int k = -kHalfWindow; k <= kHalfWindow; ++k)
      points_um_[i] += (1.0 / (2 * kHalfWindow + 1)) * dense[(i + k + n) % n];
  const std::vector<int> corners = corner_indices(points_um_);
  for (const int c : corners) {  // the average rounds them off: take the line itself back
    for (int k = -kHalfWindow; k <= kHalfWindow; ++k) points_um_[(c + k + n) % n] = dense[(c + k + n) % n];
    Vec2 tip = dense[c];
    double sharpest = -1;
    for (const Vec2 candidate : outline) {
      if (norm(candidate - dense[c]) > 1.5 * perimeter / n) continue;
      const double away =
          norm(candidate - 0.5 * (dense[(c + kHalfWindow + 1) % n] + dense[(c + n - kHalfWindow - 1) % n]));
      if (away > sharpest) {
        sharpest = away;
        tip = candidate;
      }
    }
    points_um_[c] = tip;
  }
  start_um_.resize(n + 1);
  for (int i = 0; i < n; ++i) start_um_[i + 1] = start_um_[i] + norm(points_um_[(i + 1) % n] - points_um_[i]);
  for (const int c : corners) corners_um_.push_back(start_um_[c]);
  index_stripes();
}

int OutlineCurve::stripe_of(double y_um) const {
  return static_cast<int>(std::clamp((y_um - top_um_) / stripe_um_, 0.0, static_cast<double>(stripes_.size()) - 1));
}

void OutlineCurve::index_stripes() {
  const auto [low, high] =
      std::minmax_element(points_um_.begin(), points_um_.end(), [](Vec2 a, Vec2 b) { return a.y < b.y; });
  const std::size_t n = points_um_.size();
  top_um_ = low->y;
  stripe_um_ = std::max((high->y - low->y) / static_cast<double>(n), std::numeric_limits<double>::min());
  stripes_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto [y0, y1] = std::minmax(points_um_[i].y, points_um_[(i + 1) % n].y);
    for (int stripe = stripe_of(y0); stripe <= stripe_of(y1); ++stripe) stripes_[stripe].push_back(static_cast<int>(i));
  }
}

bool OutlineCurve::contains(Vec2 point_um) const {
  bool is_inside = false;
  for (const int i : stripes_[stripe_of(point_um.y)]) {
    const Vec2 a = points_um_[i];
    const Vec2 b = points_um_[(i + 1) % points_um_.size()];
    if ((a.y > point_um.y) == (b.y > point_um.y)) continue;
    if (point_um.x < a.x + (point_um.y - a.y) / (b.y - a.y) * (b.x - a.x)) is_inside = !is_inside;
  }
  return is_inside;
}

double OutlineCurve::wrapped(double s_um) const {
  const double s = std::fmod(s_um, length_um());
  return s < 0 ? s + length_um() : s;
}

Vec2 OutlineCurve::at(double s_um) const {
  const double s = wrapped(s_um);
  const auto next = std::upper_bound(start_um_.begin(), start_um_.end() - 1, s);
  const std::size_t i = static_cast<std::size_t>(next - start_um_.begin()) - 1;
  const double piece = start_um_[i + 1] - start_um_[i];
  const double along = piece > 0 ? (s - start_um_[i]) / piece : 0.0;
  return points_um_[i] + along * (points_um_[(i + 1) % points_um_.size()] - points_um_[i]);
}

OutlineCurve::Nearest OutlineCurve::nearest_on_piece(std::size_t piece, Vec2 point_um) const {
  const Vec2 a = points_um_[piece];
  const Vec2 step = points_um_[(piece + 1) % points_um_.size()] - a;
  const double along = nearest_share(a, a + step, point_um);
  return {wrapped(start_um_[piece] + along * (start_um_[piece + 1] - start_um_[piece])),
          norm(point_um - (a + along * step))};
}

Boundary::Boundary(const Cell& cell, double edge_um) : edge_um_(edge_um) {
  rings_.emplace_back(cell.outline_um, edge_um);
  const double smallest_um2 = 0.25 * std::numbers::sqrt3 * edge_um * edge_um;
  for (const Polygon& hole : cell.holes_um)
    if (std::abs(signed_area_um2(hole)) < smallest_um2)
      ++n_filled_holes_;
    else
      rings_.emplace_back(hole, edge_um);
  grid_ = numerics::Grid(rings_.front().polygon(), edge_um);
  for (int ring = 0; ring < static_cast<int>(rings_.size()); ++ring) {
    const Polygon& corners = rings_[ring].polygon();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      grid_.add(static_cast<int>(pieces_.size()), corners[i], corners[(i + 1) % corners.size()]);
      pieces_.push_back({ring, static_cast<int>(i)});
    }
  }
}

BoundaryPlace Boundary::place(Vec2 point_um) const {
  BoundaryPlace place;
  for (std::size_t ring = 1; ring < rings_.size(); ++ring)
    place.is_in_hole = place.is_in_hole || rings_[ring].contains(point_um);
  place.is_inside = is_within_outline(point_um) && !place.is_in_hole;
  place.distance_um = std::numeric_limits<double>::infinity();
  const auto look_at = [&](int piece) {
    const auto [ring, i] = pieces_[piece];
    const auto [s_um, distance_um] = rings_[ring].nearest_on_piece(i, point_um);
    if (distance_um >= place.distance_um) return;
    place.ring = ring;
    place.s_um = s_um;
    place.distance_um = distance_um;
  };
  grid_.for_each_near(point_um, point_um, edge_um_, look_at);
  if (!place.is_inside && place.distance_um > edge_um_)
    for (int piece = 0; piece < static_cast<int>(pieces_.size()); ++piece) look_at(piece);
  if (place.distance_um > edge_um_ && place.is_inside) place.distance_um = std::numeric_limits<double>::infinity();
  return place;
}

}  // namespace mbtfm::mesh
