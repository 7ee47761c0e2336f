#include "segment/cells/claims.h"

#include <cmath>
#include <numbers>

namespace mbtfm::cells {

bool Claims::has(cv::Point2d point, double angle_rad) const {
  const int x = cvRound(point.x), y = cvRound(point.y);
  if (x < 0 || y < 0 || x >= bits_.cols || y >= bits_.rows) return false;
  return (bits_.at<int>(y, x) >> index(angle_rad)) & 1;
}

void Claims::add(cv::Point2d point, double angle_rad, double radius_px) {
  int mask = 0;
  for (int k = -1; k <= 1; ++k) mask |= 1 << ((index(angle_rad) + k + n_) % n_);
  mark(point, mask, radius_px);
}

void Claims::mark(cv::Point2d point, int mask, double radius_px) {
  const int r = static_cast<int>(std::ceil(radius_px));
  for (int dy = -r; dy <= r; ++dy)
    for (int dx = -r; dx <= r; ++dx) {
      const int x = cvRound(point.x) + dx, y = cvRound(point.y) + dy;
      if (dx * dx + dy * dy > radius_px * radius_px || x < 0 || y < 0 || x >= bits_.cols || y >= bits_.rows) continue;
      bits_.at<int>(y, x) |= mask;
    }
}

int Claims::index(double angle_rad) const {
  const int k = static_cast<int>(std::lround(angle_rad / std::numbers::pi * n_)) % n_;
  return k < 0 ? k + n_ : k;
}

}  // namespace mbtfm::cells
