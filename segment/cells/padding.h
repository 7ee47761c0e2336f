/// The parts of an image that the microscope has not recorded: registration shifts and turns pictures, and leaves one
/// value where nothing is; a saturated detector leaves its largest one. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>

namespace mbtfm::cells {

/// Use it before anything is compared with its surroundings: the edge of the padding is none of a cell.
///
/// Padding is what hangs together with a corner of the image and has its value exactly, where the rest is a convex
/// polygon, as the image of a rectangle is that was shifted and turned, even several times. A dark ground of which
/// many pixels were set to 0 has no straight sides, and a disc of light has too many: both are left as they are.
/// @param image  CV_32F
/// @returns 255 in padding, 0 elsewhere; an empty matrix where there is none
cv::Mat padding_in(const cv::Mat& image);

/// The image with the nearest recorded pixel in each one of the padding.
cv::Mat without_padding(const cv::Mat& image, const cv::Mat& padding);
inline cv::Mat without_padding(const cv::Mat& image) { return without_padding(image, padding_in(image)); }

/// The image with what may have been in its clipped pixels, which are lower bounds: the logarithm of the brightness
/// over the ground goes on through a plateau as a plate of least bending energy. Of a clipped ridge of Gaussian profile
/// that is the ridge: its logarithm is a parabola.
/// @param is_clipped  CV_8U
/// @param widest_px   half the width of what is no ground: what an opening by a disc of this radius takes off. A
/// plateau
///                    wider than this stays one: a speck of dye or a dead cell is no bundle
cv::Mat without_clipping(const cv::Mat& image, const cv::Mat& is_clipped, double widest_px);

}  // namespace mbtfm::cells
