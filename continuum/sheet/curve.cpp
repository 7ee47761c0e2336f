#include "continuum/sheet/curve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "pipeline/contract/polyline.h"
#include "pipeline/numerics/neighbour_bins.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::sheet {
namespace {

constexpr double kCornerTurn = 40 * std::numbers::pi / 180;
constexpr double kStepTurn = 30 * std::numbers::pi / 180;  // pixels turn by 45° or 90°
constexpr int kSmoothedPixels = 5;                         // a step of one pixel is gone, what is wider stays

double turn_at(const Polygon& p, std::size_t i) {
  const std::size_t n = p.size();
  const Vec2 before = p[i] - p[(i + n - 1) % n], after = p[(i + 1) % n] - p[i];
  return std::atan2(cross(before, after), dot(before, after));
}

/// Traced along pixels: many short pieces, every third point a step, steps to both sides.
bool is_stepped(const Polygon& p) {
  if (p.size() < 24) return false;
  std::size_t n_left = 0, n_right = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    n_left += turn_at(p, i) > kStepTurn;
    n_right += turn_at(p, i) < -kStepTurn;
  }
  return 3 * (n_left + n_right) > p.size() && 8 * std::min(n_left, n_right) > p.size();
}

Polygon without_steps(const Polygon& p) {
  std::vector<double> pieces;
  for (std::size_t i = 0; i < p.size(); ++i) pieces.push_back(norm(p[(i + 1) % p.size()] - p[i]));
  double perimeter = 0;
  for (const double piece : pieces) perimeter += piece;
  const double pixel = numerics::median(pieces);
  const int n = std::max(24, static_cast<int>(perimeter / pixel));
  const Polygon dense = evenly_resampled(p, n);
  Polygon smooth(dense.size());
  for (int i = 0; i < n; ++i) {
    for (int k = -kSmoothedPixels; k <= kSmoothedPixels; ++k) {
      const double weight = (kSmoothedPixels + 1.0 - std::abs(k)) / ((kSmoothedPixels + 1.0) * (kSmoothedPixels + 1.0));
      smooth[i] += weight * dense[(i + k + n) % n];
    }
  }
  return evenly_resampled(smooth, std::max(24, n / 2));
}

}  // namespace

Curve::Curve(const Polygon& given_um) : points_um_(is_stepped(given_um) ? without_steps(given_um) : given_um) {
  if (signed_area_um2(points_um_) < 0) std::reverse(points_um_.begin(), points_um_.end());
  const std::size_t n = points_um_.size();
  start_um_.assign(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) start_um_[i + 1] = start_um_[i] + norm(points_um_[(i + 1) % n] - points_um_[i]);
  std::vector<char> is_corner(n);
  tangent_in_.resize(n);
  turn_per_um_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 before = points_um_[i] - points_um_[(i + n - 1) % n], after = points_um_[(i + 1) % n] - points_um_[i];
    const double a = norm(before), b = norm(after), turn = turn_at(points_um_, i);
    is_corner[i] = std::abs(turn) > kCornerTurn;
    if (is_corner[i]) corners_um_.push_back(start_um_[i]);
    tangent_in_[i] = 1 / (a + b) * (b / a * before + a / b * after);
    turn_per_um_[i] = is_corner[i] ? 0 : turn / (0.5 * (a + b));
  }
  tangent_out_ = tangent_in_;
  for (std::size_t i = 0; i < n; ++i) {  // towards a corner: the parabola's end, or straight
    const std::size_t next = (i + 1) % n;
    const Vec2 chord = 1 / (start_um_[i + 1] - start_um_[i]) * (points_um_[next] - points_um_[i]);
    if (is_corner[i] && is_corner[next])
      tangent_out_[i] = tangent_in_[next] = chord;
    else if (is_corner[i])
      tangent_out_[i] = 2 * chord - tangent_in_[next];
    else if (is_corner[next])
      tangent_in_[next] = 2 * chord - tangent_out_[i];
  }
}

double Curve::wrapped(double s_um) const {
  const double s = std::fmod(s_um, length_um());
  return s < 0 ? s + length_um() : s;
}

std::size_t Curve::piece_at(double s_um) const {
  const auto next = std::upper_bound(start_um_.begin() + 1, start_um_.end() - 1, wrapped(s_um));
  return static_cast<std::size_t>(next - start_um_.begin()) - 1;
}

Vec2 Curve::at(double s_um) const {
  const std::size_t i = piece_at(s_um), next = (i + 1) % points_um_.size();
  const double h = start_um_[i + 1] - start_um_[i], t = (wrapped(s_um) - start_um_[i]) / h;
  const double t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * points_um_[i] + (t3 - 2 * t2 + t) * h * tangent_out_[i] +
         (3 * t2 - 2 * t3) * points_um_[next] + (t3 - t2) * h * tangent_in_[next];
}

double Curve::curvature_per_um(double s_um) const {
  const std::size_t i = piece_at(s_um);
  const double a = turn_per_um_[i], b = turn_per_um_[(i + 1) % points_um_.size()];
  return std::abs(a) > std::abs(b) ? a : b;
}

double Curve::nearest_um(Vec2 point_um) const {
  const std::size_t n = points_um_.size();
  double nearest = std::numeric_limits<double>::infinity(), s = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 a = points_um_[i], b = points_um_[(i + 1) % n];
    const double share = nearest_share(a, b, point_um), distance = norm(point_um - (a + share * (b - a)));
    if (distance >= nearest) continue;
    nearest = distance;
    s = start_um_[i] + share * (start_um_[i + 1] - start_um_[i]);
  }
  return s;
}

std::string crossing_of(const std::vector<Polygon>& rings_um) {
  struct Piece {
    Vec2 a, b;
    std::size_t ring, index;
  };
  std::vector<Piece> pieces;
  std::vector<Vec2> all;
  double length = 0;
  for (std::size_t r = 0; r < rings_um.size(); ++r) {
    for (std::size_t i = 0; i < rings_um[r].size(); ++i) {
      const Vec2 a = rings_um[r][i], b = rings_um[r][(i + 1) % rings_um[r].size()];
      pieces.push_back({a, b, r, i});
      all.push_back(a);
      length += norm(b - a);
    }
  }
  numerics::Grid grid(all, length / static_cast<double>(pieces.size()));
  for (std::size_t k = 0; k < pieces.size(); ++k) grid.add(static_cast<int>(k), pieces[k].a, pieces[k].b);
  const auto are_neighbours = [&](const Piece& p, const Piece& q) {
    const std::size_t n = rings_um[p.ring].size();
    return p.ring == q.ring && (q.index == (p.index + 1) % n || p.index == (q.index + 1) % n);
  };
  std::string found;
  for (std::size_t k = 0; k < pieces.size() && found.empty(); ++k) {
    const Piece& p = pieces[k];
    grid.for_each_near(p.a, p.b, 0, [&](int other) {
      const Piece& q = pieces[other];
      if (static_cast<std::size_t>(other) <= k || are_neighbours(p, q) || !found.empty()) return;
      const double c1 = cross(p.b - p.a, q.a - p.a), c2 = cross(p.b - p.a, q.b - p.a);
      const double c3 = cross(q.b - q.a, p.a - q.a), c4 = cross(q.b - q.a, p.b - q.a);
      if (c1 * c2 > 0 || c3 * c4 > 0 || (c1 == 0 && c2 == 0)) return;
      found = "piece " + std::to_string(p.index + 1) + " of ring " + std::to_string(p.ring) + " and piece " +
              std::to_string(q.index + 1) + " of ring " + std::to_string(q.ring);
    });
  }
  return found;
}

}  // namespace mbtfm::sheet
