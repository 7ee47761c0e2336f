/// The place of a cell's edge in profiles across it. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mbtfm::cells {

/// Move a closed ring onto the edge of the cell in the image, to a tenth of a pixel's order.
///
/// Across the edge the brightness is modelled as ground + step + slope inside + a line, all at one place d: the cell is
/// brighter than its surroundings, and the actin cortex, thinner than the microscope resolves, lies along its membrane,
/// so that its image is a line centred on the edge. (The half-height of that line lies 1.2 of its standard deviations
/// outside.) The squared residuals of all places are the cost, and the ring takes the places of least total cost plus
/// (d − d')² of neighbours over (0.1 um)², by dynamic programming (Amini, Weymouth & Jain 1990).
/// @param ring      px, at equal distances
/// @param may_move  by point
std::vector<cv::Point2d> on_edge(const cv::Mat& image, const std::vector<cv::Point2d>& ring,
                                 const std::vector<bool>& may_move, double pixel_um);

}  // namespace mbtfm::cells
