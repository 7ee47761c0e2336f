/// The mean brightness across a line. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mbtfm::cells {

struct Profile {
  double height = 0;      ///< of the middle over the mean of both sides, in grey levels
  double lower_drop = 0;  ///< from the middle to the brighter side
  double upper_drop = 0;  ///< to the darker side
  double side = 0;        ///< grey level of the sides, their mean
  double width_px = 0;    ///< full width at half of `height`
  double noise = 0;       ///< standard error of a drop
};

/// Median over the line's points of the image across it, out to `reach_px` on either side. `points` are a pixel or
/// so apart.
Profile profile_across(const cv::Mat& image, const std::vector<cv::Point2d>& points, double reach_px);

}  // namespace mbtfm::cells
