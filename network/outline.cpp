#include "network/outline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mbtfm::network {
namespace {

constexpr int kSamplesPerEdge = 8;  // a sixteenth of an edge off the line at most
constexpr int kHalfWindow = 2;      // averages over five samples, about half an edge
constexpr double kCornerTurn = 50 * std::numbers::pi / 180;

Polygon positively_oriented(Polygon polygon) {
  if (signed_area_um2(polygon) < 0) std::reverse(polygon.begin(), polygon.end());
  return polygon;
}

/// The closed line at equal steps of arc length.
Polygon resampled(const Polygon& polygon, int n) {
  double perimeter = 0;
  const std::size_t size = polygon.size();
  for (std::size_t i = 0; i < size; ++i) perimeter += norm(polygon[(i + 1) % size] - polygon[i]);
  Polygon points;
  points.reserve(n);
  double start = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const Vec2 a = polygon[i];
    const Vec2 step = polygon[(i + 1) % size] - a;
    const double length = norm(step);
    while (static_cast<int>(points.size()) < n) {
      const double s = perimeter * static_cast<double>(points.size()) / n;
      if (s >= start + length) break;
      points.push_back(a + ((s - start) / length) * step);
    }
    start += length;
  }
  while (static_cast<int>(points.size()) < n) points.push_back(polygon.front());  // rounding at the very end
  return points;
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
    for (int k = 1; k <= reach; ++k) {
      is_peak = is_peak && turns[i] >= turns[(i + k) % n] && turns[i] > turns[(i + n - k) % n];
    }
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
  const Polygon dense = resampled(outline, n);
  points_um_.resize(n);
  for (int i = 0; i < n; ++i) {
    for (int k = -kHalfWindow; k <= kHalfWindow; ++k) {
      points_um_[i] += (1.0 / (2 * kHalfWindow + 1)) * dense[(i + k + n) % n];
    }
  }
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

double OutlineCurve::nearest(Vec2 point_um) const {
  double best = 0;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points_um_.size(); ++i) {
    const Vec2 a = points_um_[i];
    const Vec2 step = points_um_[(i + 1) % points_um_.size()] - a;
    const double along = nearest_share(a, a + step, point_um);
    const Vec2 gap = point_um - (a + along * step);
    const double distance = dot(gap, gap);
    if (distance < smallest) {
      smallest = distance;
      best = start_um_[i] + along * (start_um_[i + 1] - start_um_[i]);
    }
  }
  return wrapped(best);
}

}  // namespace mbtfm::network
