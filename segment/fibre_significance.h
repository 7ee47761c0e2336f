/// What tells a bundle from the meshwork of the cortex. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "pipeline/contract/types.h"
#include "segment/ridge.h"

namespace mbtfm::segment {

/// Signal to noise of a whole line: its mean height in standard deviations of the texture around, times the root of the
/// number of independent pieces in its length. Texture averages out along a line, a bundle persists.
double significance(const Ridges& ridges, const std::vector<cv::Point2d>& points, const std::vector<double>& height,
                    double independent_px);

/// How many lines at least as significant one finds by chance in the texture of a cell: the number of false alarms
/// (Desolneux, Moisan & Morel, From Gestalt Theory to Image Analysis, Springer 2008, ch. 3).
/// @param free_area_um2  of the cell, without what its fibres cover
double expected_false_lines(double significance, double free_area_um2);

/// Share of a line that has one of these fibres beside it: nearer than 3 um, at less than 15 degrees. Bundles lie in
/// carpets; a line of texture is beside one by chance.
/// @param line_um, fibres_um  with points about a pixel apart
double share_beside(const Polyline& line_um, const std::vector<Polyline>& fibres_um);

/// The chance that such a line is a fibre, where by chance there would be `n_false` at least as significant: the
/// density of fibres at that significance over that of all lines.
double chance_of_fibre(double n_false);

/// Does the line wind to and fro, as a fold of the membrane does and a bundle under tension does not? Turning beyond
/// its net turning, by length.
bool winds(const Polyline& line_um);

}  // namespace mbtfm::segment
