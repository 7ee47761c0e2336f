/// What lies near a point of an image. Internal to segment/ (OpenCV types).
#pragma once

#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

namespace mbtfm::cells {

/// Items by squares of the image.
template <class Item>
class Squares {
 public:
  explicit Squares(double side) : side_(side) {}
  void add(cv::Point2d point, Item item) { squares_[square(point, 0, 0)].push_back(std::move(item)); }
  /// Those in the square of a point and in its neighbours.
  template <class Use>
  void each_near(cv::Point2d point, const Use& use) const {
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        if (const auto found = squares_.find(square(point, dx, dy)); found != squares_.end())
          for (const Item& item : found->second) use(item);
  }

 private:
  std::pair<int, int> square(cv::Point2d p, int dx, int dy) const {
    return {static_cast<int>(std::floor(p.x / side_)) + dx, static_cast<int>(std::floor(p.y / side_)) + dy};
  }
  double side_;
  std::map<std::pair<int, int>, std::vector<Item>> squares_;
};

}  // namespace mbtfm::cells
