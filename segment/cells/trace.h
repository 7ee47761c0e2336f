/// Lines traced along ridges. Internal to segment/ (OpenCV types). Lengths in pixels of the ridges' matrices.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "segment/cells/ridge.h"

namespace mbtfm::cells {

/// One traced line: points a pixel apart.
struct Trace {
  std::vector<cv::Point2d> points;
  std::vector<double> height;   ///< of the ridge at each
  std::vector<bool> is_shared;  ///< the height is that of another line, upon which it runs there

  std::size_t size() const { return points.size(); }
  /// The points from `from` to before `to`.
  Trace part(std::size_t from, std::size_t to) const;
  void reverse();
  void append(const Trace& other);
  /// 0 where it is another line's.
  std::vector<double> own_height() const;
};

struct TraceRule {
  double start_noise = 6;          ///< standard deviations a line must reach somewhere
  double follow_noise = 2.5;       ///< and those it may fall to
  double follow_share = 0.4;       ///< or this share of its height so far, where that is more
  double start_gain_px = 20;       ///< length of bright line through a place, both ways, that a line starts from
  double reach_px = 20;            ///< a line looks this far ahead for its best way on
  double step_px = 3;              ///< and again after each step of this length
  double through_px = 30;          ///< it may be hidden, or run upon another one, for this long
  double smallest_radius_px = 30;  ///< of curvature
  double line_radius_px = 3;       ///< a second line of the same direction within it is the same
  double shortest_px = 15;
  double end_level = 0.5;        ///< a line ends where its height falls to this share of what it is before
  double end_window_px = 20;     ///< over this length
  double course_px = 25;         ///< this length of an end shows where it points
  double join_gap_px = 15;       ///< ends that point at each other from this far may be one line
  double overlap_px = 25;        ///< and ends that lie beside each other over this length
  double bridge_px = 90;         ///< longest gap between pieces of one fibre
  double bridge_course_px = 60;  ///< of which so much of either end shows the course
  double bridge_misfit_px = 0.7;
  double bridge_radius_px = 500;
  double faint_px = 40;  ///< how far beyond its end a line may go on faintly
};

/// Follow lines from the places through which the best arcs go, both ways, each along its best way on in position,
/// direction and curvature (`Ways`): lines that cross have another direction, and no line kinks into them. Then cut
/// ends that fade, join collinear pieces, drop the short ones.
/// @param is_inside  CV_8U, not 0 where a line may start
/// @param known  lines found before: nothing is traced along them
std::vector<Trace> trace_lines(const Ridges& ridges, const cv::Mat& is_inside, const TraceRule& rule,
                               const std::vector<Trace>& known = {});

/// Where a line would go on beyond its end: points a pixel apart from there outwards, and by point the response in
/// standard deviations of the noise, which may be none.
struct FaintEnd {
  std::vector<cv::Point2d> points;
  std::vector<double> over_noise;
};
enum class LineEnd { first, last };
FaintEnd faint_end(const Ridges& ridges, const TraceRule& rule, const Trace& trace, LineEnd end);

/// Unit vector from the inside of the line to its first or last point, over `reach` pixels.
cv::Point2d outward(const std::vector<cv::Point2d>& points, LineEnd end, double reach);

}  // namespace mbtfm::cells
