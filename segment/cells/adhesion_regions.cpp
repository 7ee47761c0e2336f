#include "segment/cells/adhesion_regions.h"

#include <algorithm>

namespace mbtfm::cells {

namespace {

/// Regions that grow from their maxima and may be joined: a union-find whose root is the region with the higher peak.
class Regions {
 public:
  int add(float peak) {
    parent_.push_back(static_cast<int>(parent_.size()));
    peak_.push_back(peak);
    size_.push_back(1);
    return parent_.back();
  }
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int into, int from) {
    parent_[from] = into;
    size_[into] += size_[from];
  }
  void grow(int i) { ++size_[i]; }
  float peak(int i) const { return peak_[i]; }
  int size(int i) const { return size_[i]; }

 private:
  std::vector<int> parent_, size_;
  std::vector<float> peak_;
};

std::vector<int> masked_pixels_from_the_highest(const cv::Mat& height, const cv::Mat& mask) {
  std::vector<int> pixels;
  for (int i = 0; i < height.rows * height.cols; ++i)
    if (mask.at<uchar>(i / height.cols, i % height.cols)) pixels.push_back(i);
  const float* value = height.ptr<float>();
  std::sort(pixels.begin(), pixels.end(),
            [&](int a, int b) { return value[a] > value[b] || (value[a] == value[b] && a < b); });
  return pixels;
}

}  // namespace

cv::Mat split_regions(const cv::Mat& height, const cv::Mat& noise, const cv::Mat& mask, const SplitRule& rule) {
  const cv::Mat value = height.isContinuous() ? height : height.clone();
  cv::Mat labels(height.size(), CV_32S, cv::Scalar(-1));
  Regions regions;
  const int columns = height.cols;
  for (const int pixel : masked_pixels_from_the_highest(value, mask)) {
    const int x = pixel % columns, y = pixel / columns;
    const float level = value.at<float>(y, x);
    int own = -1;
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const int u = x + dx, v = y + dy;
      if (u < 0 || v < 0 || u >= columns || v >= height.rows || labels.at<int>(v, u) < 0) continue;
      int other = regions.root(labels.at<int>(v, u));
      if (own < 0 || own == other) {
        own = other;
        continue;
      }
      if (regions.peak(other) > regions.peak(own)) std::swap(own, other);
      const double dip = regions.peak(other) - level;
      const double needed = std::max<double>(rule.depth * regions.peak(other), 3 * noise.at<float>(y, x));
      if (dip < needed || regions.size(other) < rule.smallest_px) regions.join(own, other);
    }
    if (own < 0)
      own = regions.add(level);
    else
      regions.grow(own);
    labels.at<int>(y, x) = own;
  }
  std::vector<int> name;  // roots renamed 1, 2, … in raster order
  int n_names = 0;
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < columns; ++x) {
      int& label = labels.at<int>(y, x);
      if (label < 0) {
        label = 0;
        continue;
      }
      const int root = regions.root(label);
      if (root >= static_cast<int>(name.size())) name.resize(static_cast<std::size_t>(root) + 1, 0);
      if (!name[root]) name[root] = ++n_names;
      label = name[root];
    }
  return labels;
}

}  // namespace mbtfm::cells
