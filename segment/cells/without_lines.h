/// An image without its lines. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mbtfm::cells {

/// A line that is seen in an image.
struct SeenLine {
  std::vector<cv::Point2d> points;  ///< a pixel apart
  double width_px = 5;              ///< full width at half maximum
};

/// What is left of an image when the lines are taken away: each a Gaussian ridge whose height varies along it, no
/// faster than the averaging. Heights are fitted to what all the others leave, the profile and a constant across, by
/// turns, so that lines that touch share what is there. Shows fainter lines beside bright ones.
/// @param averaging_px  standard deviation along the line
cv::Mat without_lines(const cv::Mat& image, const std::vector<SeenLine>& lines, double averaging_px);

}  // namespace mbtfm::cells
