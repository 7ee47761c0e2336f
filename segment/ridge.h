/// Oriented ridge filters: how fibre-like an image is at each point, in each direction. Internal to segment/ (OpenCV).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mbtfm::segment {

/// Responses to a bright line through each pixel, by direction.
struct Ridges {
  std::vector<cv::Mat> response;  ///< [k]: lines along k·π/n from +x towards +y, in grey levels of the line's height
  cv::Mat noise;                  ///< standard deviation of a response where there is no line
  cv::Mat strongest;              ///< greatest response over the directions
  cv::Mat direction;              ///< its index (CV_32S)

  int n_directions() const { return static_cast<int>(response.size()); }
  /// Response at a point for lines along `angle_rad`, interpolated in position and direction.
  double at(cv::Point2d point, double angle_rad) const;
};

struct RidgeScales {
  std::vector<double> width_sigma_px;  ///< of the Gaussian profile of the lines looked for
  double length_sigma_px = 5;          ///< of the averaging along the line
  double noise_radius_px = 40;         ///< the noise is taken over a disc of this radius
};

/// Second derivative of a Gaussian across, Gaussian along, normalised so that a straight line of Gaussian profile with
/// the filter's own width and height 1 gives 1; for each direction the greatest response over the widths. The noise is
/// the greater of the camera's white noise through the filter and the local robust spread of the responses (texture).
Ridges find_ridges(const cv::Mat& image, const RidgeScales& scales, int n_directions = 16);

}  // namespace mbtfm::segment
