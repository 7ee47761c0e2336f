/// What an image shows beside its lines. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "segment/cells/ridge.h"

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

/// The crests of ridges as high as the middle one of these fibres, away from all of them: what the tracing, or the
/// judgement of a line, has missed.
/// @param is_inside    CV_8U, not 0 where fibres may be
/// @param fibres       points about a pixel apart
/// @param aside_px     crests nearer to a fibre are its own
/// @param shortest_px  of a crest; shorter ones are specks
/// @returns by crest its points, in no order; nothing of fewer than five fibres, which do not show what bright is
std::vector<std::vector<cv::Point2d>> bright_crests_beside(const Ridges& ridges, const cv::Mat& is_inside,
                                                           const std::vector<std::vector<cv::Point2d>>& fibres,
                                                           double aside_px, double shortest_px);

}  // namespace mbtfm::cells
