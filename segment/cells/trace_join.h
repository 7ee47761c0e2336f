/// Pieces of one line put together, by parabolas through them. Internal to segment/ (OpenCV types). Lengths in pixels.
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

/// Pieces put together to lines, each end once and no line to a ring. How well ends fit is judged by their turn, their
/// offset, the gap between them, their heights, and by whether something bright lies in the gap; the best pair first.
/// Candidates come from a grid of the ends: time grows with the number of pieces.
std::vector<Trace> joined(std::vector<Trace> traces, const Ridges& ridges, const TraceRule& rule);

struct BridgedLine {
  Trace trace;
  std::vector<std::size_t> pieces;  ///< by place among the fibres, in the order of the line
};

/// Fibres put together across gaps that are longer than a hidden line's: over the rim of the nucleus, or where a
/// neighbour in the same carpet outshines them. Pairs of ends that are of one fibre rather than not, the best first.
/// @param ridges  of the image without these fibres: what is bright in a gap is no neighbour
std::vector<BridgedLine> bridged(const std::vector<Trace>& fibres, const Ridges& ridges, const TraceRule& rule);

/// By end, the first of each line before its last, how probable it is that the line goes on as another one: that of the
/// best partner, by logistic regression on simulated cells (notes/dense_fibres.md).
std::vector<double> chances_of_going_on(const std::vector<Trace>& fibres, const Ridges& ridges, const TraceRule& rule);

/// Where lines cross at a small angle one may be led on over the other's course, and the other ends there. A line that
/// ends on another one gets back the part of it that lies on its own course: if both together lie on a slightly bent
/// parabola, and the other one's two parts do not. What is left of the other one ends there.
std::vector<Trace> with_own_courses(std::vector<Trace> lines, const Ridges& ridges, const TraceRule& rule);

}  // namespace mbtfm::cells
