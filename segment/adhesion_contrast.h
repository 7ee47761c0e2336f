/// How far each pixel of an adhesion image stands out. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>

#include "segment/adhesions.h"

namespace mbtfm::segment {

/// What an adhesion's pixels are compared to.
struct Contrast {
  cv::Mat sharp;        ///< image above the local background
  cv::Mat sharp_noise;  ///< standard deviation of a pixel
  cv::Mat height;       ///< `sharp`, smoothed
  cv::Mat noise;        ///< standard deviation of `height` where there is no adhesion
  double floor;         ///< heights below are texture or rounding
  cv::Mat least_seed;   ///< heights below may be a step of the background, as at the edge of a bright cell
};

Contrast contrast_of(const cv::Mat& image, double pixel_size_um, const AdhesionParameters& parameters);

/// 255 where the height is that many standard deviations of the noise, and above the floor.
cv::Mat above(const Contrast& contrast, double n_sigma);

}  // namespace mbtfm::segment
