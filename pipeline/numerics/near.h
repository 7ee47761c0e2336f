/// Which points lie near a place in space.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::numerics {

/// Points sorted into cubic cells.
class Near {
 public:
  Near() = default;
  Near(std::vector<Vec3> points, double cell) : points_(std::move(points)) {
    if (points_.empty()) return;
    Vec3 high = points_[0];
    low_ = points_[0];
    for (const Vec3& p : points_) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    // no more cells than some for each point, however far apart the points are: in space, in a plane, on a line
    const double most = 4.0 * static_cast<double>(points_.size()) + 64;
    const Vec3 size = high - low_;
    const auto plane = [&](double a, double b) { return std::sqrt(a / most) * std::sqrt(b); };
    cell_ = std::max({cell, std::cbrt(size.x / most) * std::cbrt(size.y) * std::cbrt(size.z), plane(size.x, size.y),
                      plane(size.y, size.z), plane(size.z, size.x), std::max({size.x, size.y, size.z}) / most, 1e-300});
    nx_ = 1 + static_cast<int>(size.x / cell_), ny_ = 1 + static_cast<int>(size.y / cell_);
    nz_ = 1 + static_cast<int>(size.z / cell_);
    first_.assign(static_cast<std::size_t>(nx_) * ny_ * nz_ + 1, 0);
    for (const Vec3& p : points_) ++first_[cell_of(p) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<int> next(first_.begin(), first_.end() - 1);
    order_.resize(points_.size());
    for (std::size_t k = 0; k < points_.size(); ++k) order_[next[cell_of(points_[k])]++] = static_cast<int>(k);
  }

  const std::vector<Vec3>& points() const { return points_; }

  /// Indices of the points within `radius`, nearest first, at most `n`.
  std::vector<int> within(Vec3 place, double radius, int n) const {
    std::vector<std::pair<double, int>> found;
    collect(place, radius, found);
    return nearest_of(found, n);
  }

  /// Indices of the n nearest points, nearest first.
  std::vector<int> nearest(Vec3 place, int n) const {
    std::vector<std::pair<double, int>> found;
    const double span = cell_ * (nx_ + ny_ + nz_);
    for (double radius = cell_;; radius *= 1.5) {
      found.clear();
      collect(place, radius, found);
      // a place beyond all points needs a wider look than the points themselves span
      if (static_cast<int>(found.size()) >= n || found.size() == points_.size() || radius > 1e3 * span) break;
    }
    return nearest_of(found, n);
  }

 private:
  static int clamped(double offset, int n) {
    return static_cast<int>(std::clamp(std::floor(offset), 0.0, static_cast<double>(n - 1)));
  }
  std::size_t cell_of(Vec3 p) const {
    const Vec3 d = (1 / cell_) * (p - low_);
    return (static_cast<std::size_t>(clamped(d.z, nz_)) * ny_ + clamped(d.y, ny_)) * nx_ + clamped(d.x, nx_);
  }
  void collect(Vec3 place, double radius, std::vector<std::pair<double, int>>& found) const {
    if (points_.empty()) return;
    const Vec3 reach{radius, radius, radius};
    const Vec3 a = (1 / cell_) * (place - reach - low_), b = (1 / cell_) * (place + reach - low_);
    for (int k = clamped(a.z, nz_); k <= clamped(b.z, nz_); ++k) {
      for (int j = clamped(a.y, ny_); j <= clamped(b.y, ny_); ++j) {
        const std::size_t row = (static_cast<std::size_t>(k) * ny_ + j) * nx_;
        for (int at = first_[row + clamped(a.x, nx_)]; at < first_[row + clamped(b.x, nx_) + 1]; ++at) {
          const Vec3 d = points_[order_[at]] - place;
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

  std::vector<Vec3> points_;
  Vec3 low_;
  double cell_ = 1;
  int nx_ = 1, ny_ = 1, nz_ = 1;
  std::vector<int> first_ = {0, 0};  ///< of each cell in order_
  std::vector<int> order_;
};

}  // namespace mbtfm::numerics
