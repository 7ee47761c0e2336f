/// Square bins to find what lies near a point or a box.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/contract/extent.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::numerics {

class Grid {
 public:
  /// Covers the box of `points`; bins of `bin_um` or larger where there would be many more bins than points.
  Grid(const std::vector<Vec2>& points, double bin_um) {
    if (points.empty()) return;
    const auto [low, high] = extent_of(points);
    low_ = low;
    const Vec2 size = high - low;
    const double most = 4.0 * static_cast<double>(points.size()) + 16;
    bin_ = std::max({bin_um, std::sqrt(size.x * size.y / most), (size.x + size.y) / most, 1e-300});
    columns_ = static_cast<int>(size.x / bin_) + 1;
    rows_ = static_cast<int>(size.y / bin_) + 1;
    bins_.resize(static_cast<std::size_t>(columns_) * rows_);
  }

  /// Add an item that lies in the box of a and b.
  void add(int item, Vec2 a, Vec2 b) {
    for_each_bin(a, b, 0, [&](std::size_t bin) { bins_[bin].push_back(item); });
  }

  /// Call body(item) for the items of all bins within `reach` of the box of a and b. An item that fills several bins
  /// is named once for each call: in the first bin they share.
  template <class Body>
  void for_each_near(Vec2 a, Vec2 b, double reach, const Body& body) const {
    found_.clear();
    for_each_bin(a, b, reach,
                 [&](std::size_t bin) { found_.insert(found_.end(), bins_[bin].begin(), bins_[bin].end()); });
    std::ranges::sort(found_);
    found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
    for (const int item : found_) body(item);
  }

 private:
  int clamped(double value, int n) const { return static_cast<int>(std::clamp(value, 0.0, n - 1.0)); }

  template <class Body>
  void for_each_bin(Vec2 a, Vec2 b, double reach, const Body& body) const {
    const int x0 = clamped((std::min(a.x, b.x) - reach - low_.x) / bin_, columns_);
    const int x1 = clamped((std::max(a.x, b.x) + reach - low_.x) / bin_, columns_);
    const int y0 = clamped((std::min(a.y, b.y) - reach - low_.y) / bin_, rows_);
    const int y1 = clamped((std::max(a.y, b.y) + reach - low_.y) / bin_, rows_);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) body(static_cast<std::size_t>(y) * columns_ + x);
    }
  }

  Vec2 low_;
  double bin_ = 1;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::vector<int>> bins_;
  mutable std::vector<int> found_;  ///< scratch: one thread at a time
};

}  // namespace mbtfm::numerics
