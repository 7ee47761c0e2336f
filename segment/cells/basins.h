/// Floods of a map from its peaks down. Internal to segment/ (OpenCV types).
#pragma once

#include <algorithm>
#include <functional>
#include <numeric>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

namespace mbtfm::cells {

/// Pixels (row by row) where the mask is not 0, the highest first.
inline std::vector<int> pixels_from_the_highest(const cv::Mat& values, const cv::Mat& mask) {
  std::vector<int> pixels;
  for (int i = 0; i < static_cast<int>(mask.total()); ++i)
    if (mask.at<uchar>(i / mask.cols, i % mask.cols)) pixels.push_back(i);
  std::ranges::stable_sort(pixels, std::greater(),
                           [&](int i) { return values.at<float>(i / mask.cols, i % mask.cols); });
  return pixels;
}

/// Pixels that hang together above a level, with the highest value among them: a union-find whose root has that value.
class Basins {
 public:
  explicit Basins(std::size_t n) : parent_(n), peak_(n, 0), n_pixels_(n, 0), is_cut_(n, false) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  void add(int pixel, float value, bool is_at_border = false) {
    peak_[pixel] = value, n_pixels_[pixel] = 1, is_cut_[pixel] = is_at_border;
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

}  // namespace mbtfm::cells
