/// The course of a fibre from its traced points. Internal to segment/ (OpenCV types).
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

}  // namespace mbtfm::cells
