#include "segment/cells/necks.h"

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <set>
#include <utility>

namespace mbtfm::cells {
namespace {

constexpr double kLeastShare = 0.15;  // of the area of both: cells of one kind differ in area by less than six times

/// The basins of a distance map: pixels that hang together above a level, with the largest distance among them.
class Basins {
 public:
  explicit Basins(std::size_t n) : parent_(n), peak_(n, 0), n_pixels_(n, 0), is_cut_(n, false) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  void add(int pixel, float distance, bool is_at_border) {
    peak_[pixel] = distance, n_pixels_[pixel] = 1, is_cut_[pixel] = is_at_border;
  }
  bool has(int pixel) const { return n_pixels_[pixel] > 0; }
  int of(int pixel) {
    while (parent_[pixel] != pixel) pixel = parent_[pixel] = parent_[parent_[pixel]];
    return pixel;
  }
  float peak(int basin) const { return peak_[basin]; }
  int n_pixels(int basin) const { return n_pixels_[basin]; }
  bool is_cut(int basin) const { return is_cut_[basin]; }  ///< by the image's border
  void join(int a, int b) {
    if (a == b) return;
    if (peak_[b] > peak_[a]) std::swap(a, b);
    parent_[b] = a;
    n_pixels_[a] += n_pixels_[b];
    is_cut_[a] = is_cut_[a] || is_cut_[b];
  }

 private:
  std::vector<int> parent_;
  std::vector<float> peak_;
  std::vector<int> n_pixels_;
  std::vector<bool> is_cut_;
};

struct Meeting {
  int a, b, pixel;  ///< two basins that met at a neck, and where
};

}  // namespace

CutMask cut_at_necks(const cv::Mat& mask, double narrow, double smallest) {
  CutMask result{mask.clone(), cv::Mat::zeros(mask.size(), CV_8U), {}};
  cv::Mat distance;
  cv::distanceTransform(mask, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  std::vector<int> order;
  for (int i = 0; i < static_cast<int>(mask.total()); ++i)
    if (mask.at<uchar>(i / mask.cols, i % mask.cols)) order.push_back(i);
  const auto distance_at = [&](int i) { return distance.at<float>(i / mask.cols, i % mask.cols); };
  std::ranges::stable_sort(order, std::greater(), distance_at);

  const auto neighbours_of = [&](int i) {
    const int x = i % mask.cols, y = i / mask.cols;
    return std::array{x > 0 ? i - 1 : -1, x + 1 < mask.cols ? i + 1 : -1, y > 0 ? i - mask.cols : -1,
                      y + 1 < mask.rows ? i + mask.cols : -1};
  };
  Basins basins(mask.total());
  std::vector<Meeting> meetings;
  for (const int i : order) {
    const std::array<int, 4> around = neighbours_of(i);
    basins.add(i, distance_at(i), std::ranges::find(around, -1) != around.end());
    for (const int j : around) {
      if (j < 0 || !basins.has(j)) continue;
      const int own = basins.of(i), other = basins.of(j);
      if (own == other) continue;
      if (distance_at(i) < narrow * std::min(basins.peak(own), basins.peak(other)))
        meetings.push_back({own, other, i});
      else
        basins.join(own, other);
    }
  }
  // What is too small for a cell is a part of what it hangs on, the widest way first.
  for (bool is_changed = true; is_changed;) {
    is_changed = false;
    for (const Meeting& m : meetings) {
      const int a = basins.of(m.a), b = basins.of(m.b);
      const int less = basins.n_pixels(a) < basins.n_pixels(b) ? a : b;
      const double n = basins.n_pixels(less), both = basins.n_pixels(a) + basins.n_pixels(b);
      if (a == b || (n >= smallest && (basins.is_cut(less) || n >= kLeastShare * both))) continue;
      basins.join(a, b);
      is_changed = true;
    }
  }
  std::set<std::pair<int, int>> cut;
  for (const Meeting& m : meetings) {
    const int a = basins.of(m.a), b = basins.of(m.b);
    if (a == b || !cut.insert(std::minmax({a, b})).second) continue;
    result.necks.push_back({{m.pixel % mask.cols, m.pixel / mask.cols}, 2.0 * distance_at(m.pixel)});
  }
  for (const int i : order)
    for (const int j : neighbours_of(i))
      if (j >= 0 && basins.has(j) && basins.of(j) < basins.of(i)) result.cuts.data[i] = 255;
  result.mask &= ~result.cuts;
  return result;
}

}  // namespace mbtfm::cells
