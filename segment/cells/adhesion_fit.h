/// Adhesions as blurred elliptical discs. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "segment/cells/blurred_ellipse.h"

namespace mbtfm::cells {

struct FittedEllipse {
  BlurredEllipse ellipse;
  double ground = 0;        ///< level around it
  bool is_settled = false;  ///< the iteration ended at a minimum that is an ellipse within the window
  double scatter = 0;       ///< mean square of what the model leaves
  double unexplained = 1;   ///< share of the window's variance, less that of the noise, that the model leaves
};

/// What the adhesions of an image have in common.
struct CommonShape {
  double blur = 1;  ///< px
  double dome = 0;
};

/// Blur and dome as the forty widest adhesions show them: the mean over fits in which they are free, weighted by the
/// information of each, and by what is known before: the blur of `start` to a factor of 1.6, its dome to 0.2.
/// @param start  at least one, of equal blur and dome
CommonShape common_shape(const cv::Mat& height, const std::vector<BlurredEllipse>& start);

/// Fit each ellipse and a level ground to the pixels of its window (Levenberg–Marquardt), the light of its neighbours
/// taken off as they were fitted in the round before; bytes do not depend on the number of threads.
/// @param height  image above its background
/// @param noise   standard deviation of a pixel
/// @param start   with their blur and dome, which stay
std::vector<FittedEllipse> fit_ellipses(const cv::Mat& height, const cv::Mat& noise,
                                        const std::vector<BlurredEllipse>& start);

}  // namespace mbtfm::cells
