/// The course of a fibre from its traced points, and the mean brightness across it. Internal to segment/ (OpenCV
/// types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::cells {

/// Mean of neighbours over ± half a window that shrinks towards the ends, which stay.
std::vector<cv::Point2d> smoothed(const std::vector<cv::Point2d>& points, int half_window);

/// The longest piece of the line that does not run along the outline: within `distance_um` of it at less than 30°.
/// What lies outside runs along it. @param points_um  one a trace's point; empty outline: the whole line
struct Piece {
  std::size_t first = 0, n = 0;  ///< of the line's points
};
Piece without_edge(const Polyline& points_um, const Polygon& outline_um, double distance_um);

/// Douglas–Peucker: points are left out where the line moves less than the tolerance; first and last stay.
Polyline simplified(const Polyline& line, double tolerance_um);

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
