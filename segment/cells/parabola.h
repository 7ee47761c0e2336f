/// Parabolas through pieces of lines. Internal to segment/ (OpenCV types). Lengths in pixels.
#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "segment/cells/trace.h"

namespace mbtfm::cells {

/// The parabola through the last parts of two lines that face each other, in the frame of the line from the beginning
/// of the one part to that of the other.
struct Parabola {
  cv::Point2d origin, along;
  cv::Vec3d coefficients;
  double from = 0, to = 0;  ///< along it, of the gap
  double misfit_px = 0;     ///< root mean square distance of both parts

  double offset(double s) const { return coefficients[0] + s * (coefficients[1] + s * coefficients[2]); }
  double curvature() const { return 2 * std::abs(coefficients[2]); }
  cv::Point2d at(double s) const { return origin + s * along + offset(s) * cv::Point2d(-along.y, along.x); }
  double angle_rad(double s) const {
    return std::atan2(along.y, along.x) + std::atan(coefficients[1] + 2 * s * coefficients[2]);
  }
};

/// The last part of a line, from its end inwards.
std::vector<cv::Point2d> last_part(const Trace& trace, LineEnd end, double length_px);

/// Through two parts, each from its end inwards. Both count alike, however long they are.
Parabola parabola_through(const std::vector<cv::Point2d>& a, const std::vector<cv::Point2d>& b);

/// The points on the way over a gap, a pixel apart.
Trace bridge_of(const Parabola& way, const Ridges& ridges);

}  // namespace mbtfm::cells
