/// Which points lie near a place in the plane or in space.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::numerics {

inline std::array<double, 3> coordinates(Vec2 p) { return {p.x, p.y, 0}; }
inline std::array<double, 3> coordinates(Vec3 p) { return {p.x, p.y, p.z}; }

/// Points sorted into square or cubic cells.
template <class Point>
class Neighbours {
 public:
  Neighbours() = default;
  Neighbours(std::vector<Point> points, double cell) : points_(std::move(points)) {
    if (points_.empty()) return;
    low_ = coordinates(points_[0]);
    std::array<double, 3> size = low_;  // first the highest
    for (const Point& p : points_)
      for (int a = 0; a < 3; ++a) {
        low_[a] = std::min(low_[a], coordinates(p)[a]);
        size[a] = std::max(size[a], coordinates(p)[a]);
      }
    for (int a = 0; a < 3; ++a) size[a] -= low_[a];
    // no more cells than some for each point, however far apart the points are: in space, in a plane, on a line
    const auto [x, y, z] = size;
    const double most = 4.0 * static_cast<double>(points_.size()) + 64;
    const auto plane = [&](double a, double b) { return std::sqrt(a / most) * std::sqrt(b); };
    cell_ = std::max({cell, std::cbrt(x / most) * std::cbrt(y) * std::cbrt(z), plane(x, y), plane(y, z), plane(z, x),
                      std::max({x, y, z}) / most, 1e-300});
    for (int a = 0; a < 3; ++a) n_[a] = 1 + static_cast<int>(size[a] / cell_);
    first_.assign(static_cast<std::size_t>(n_[0]) * n_[1] * n_[2] + 1, 0);
    for (const Point& p : points_) ++first_[cell_of(p) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<int> next(first_.begin(), first_.end() - 1);
    order_.resize(points_.size());
    for (std::size_t k = 0; k < points_.size(); ++k) order_[next[cell_of(points_[k])]++] = static_cast<int>(k);
  }

  const std::vector<Point>& points() const { return points_; }

  /// Indices of the points within `radius`, nearest first, at most `n`.
  std::vector<int> within(Point place, double radius, int n) const {
    std::vector<std::pair<double, int>> found;
    collect(place, radius, found);
    return nearest_of(found, n);
  }

  /// Indices of the n nearest points, nearest first.
  std::vector<int> nearest(Point place, int n) const {
    std::vector<std::pair<double, int>> found;
    const double span = cell_ * (n_[0] + n_[1] + n_[2]);
    for (double radius = cell_;; radius *= 1.5) {
      found.clear();
      collect(place, radius, found);
      // a place beyond all points needs a wider look than the points themselves span
      if (static_cast<int>(found.size()) >= n || found.size() == points_.size() || radius > 1e3 * span) break;
    }
    return nearest_of(found, n);
  }

 private:
  /// Of a coordinate along an axis; beyond the cells the last one.
  int index(double at, int axis) const {
    return static_cast<int>(std::clamp(std::floor((at - low_[axis]) / cell_), 0.0, n_[axis] - 1.0));
  }
  std::size_t row(int j, int k) const { return (static_cast<std::size_t>(k) * n_[1] + j) * n_[0]; }
  std::size_t cell_of(Point p) const {
    const auto [x, y, z] = coordinates(p);
    return row(index(y, 1), index(z, 2)) + index(x, 0);
  }
  void collect(Point place, double radius, std::vector<std::pair<double, int>>& found) const {
    if (points_.empty()) return;
    const auto [x, y, z] = coordinates(place);
    const int left = index(x - radius, 0), right = index(x + radius, 0);
    for (int k = index(z - radius, 2); k <= index(z + radius, 2); ++k) {
      for (int j = index(y - radius, 1); j <= index(y + radius, 1); ++j) {
        for (int at = first_[row(j, k) + left]; at < first_[row(j, k) + right + 1]; ++at) {
          const Point d = points_[order_[at]] - place;
          if (dot(d, d) <= radius * radius) found.emplace_back(dot(d, d), order_[at]);
        }
      }
    }
  }
  static std::vector<int> nearest_of(std::vector<std::pair<double, int>>& found, int n) {
    const std::size_t kept = std::min(found.size(), static_cast<std::size_t>(n));
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end());
    std::vector<int> result(kept);
    for (std::size_t k = 0; k < kept; ++k) result[k] = found[k].second;
    return result;
  }

  std::vector<Point> points_;
  std::array<double, 3> low_{};
  std::array<int, 3> n_{1, 1, 1};
  double cell_ = 1;
  std::vector<int> first_ = {0, 0};  ///< of each cell in order_
  std::vector<int> order_;
};
using Near = Neighbours<Vec3>;

}  // namespace mbtfm::numerics
