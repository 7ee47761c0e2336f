/// Where lines run already. Internal to segment/ (OpenCV types). Lengths in pixels.
#pragma once

#include <opencv2/core.hpp>

namespace mbtfm::cells {

/// Which directions of lines already pass through each pixel, a bit each.
class Claims {
 public:
  Claims(cv::Size size, int n_directions) : bits_(size, CV_32S, cv::Scalar(0)), n_(n_directions) {}

  bool has(cv::Point2d point, double angle_rad) const;
  /// Lines within one of the filter's directions.
  void add(cv::Point2d point, double angle_rad, double radius_px);
  void add_all_directions(cv::Point2d point, double radius_px) { mark(point, (1 << n_) - 1, radius_px); }

 private:
  void mark(cv::Point2d point, int mask, double radius_px);
  int index(double angle_rad) const;
  cv::Mat bits_;
  int n_;
};

}  // namespace mbtfm::cells
