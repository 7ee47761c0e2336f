/// Regions of an image above a level, split at intensity dips. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>

namespace mbtfm::cells {

struct SplitRule {
  double depth = 0.25;     ///< share of the lower of two maxima
  double smallest_px = 1;  ///< a region with fewer pixels joins its neighbour
};

/// Connected pixels (4-neighbours) where `mask` is not 0, split by flooding from the highest pixel down: where two
/// regions meet they stay apart if the dip between them is deeper than the rule's share of the lower maximum and than
/// three standard deviations of the noise there, and both are large enough.
/// @returns labels from 1 (CV_32S), 0 outside
cv::Mat split_regions(const cv::Mat& height, const cv::Mat& noise, const cv::Mat& mask, const SplitRule& rule);

}  // namespace mbtfm::cells
