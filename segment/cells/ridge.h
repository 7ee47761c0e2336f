/// Oriented ridge filters: how fibre-like an image is at each point, in each direction. Internal to segment/ (OpenCV).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mbtfm::cells {

/// Responses to a bright line through each pixel, by direction.
struct Ridges {
  std::vector<cv::Mat> response;  ///< [k]: lines along k·π/n from +x towards +y, in grey levels of the line's height
  cv::Mat noise;                  ///< standard deviation of a response where there is no fibre
  cv::Mat camera_noise;           ///< the part of it that the camera makes
  cv::Mat strongest;              ///< greatest response over the directions
  cv::Mat direction;              ///< its index (CV_8U)

  int n_directions() const { return static_cast<int>(response.size()); }
  /// Response at a point for lines along `angle_rad`, interpolated in position and direction.
  double at(cv::Point2d point, double angle_rad) const;
  /// Of the strongest direction at a pixel. @return from +x towards +y, from 0 to below pi
  double angle_rad(int x, int y) const;
  /// Is the strongest response here greatest across its own direction? Not for pixels on the border.
  bool is_crest(int x, int y) const;
};

struct RidgeScales {
  double width_sigma_px = 2;    ///< of the Gaussian profile of the lines looked for
  double length_sigma_px = 5;   ///< of the averaging along the line
  double noise_radius_px = 40;  ///< the noise is taken over a disc of this radius
};

/// Second derivative of a Gaussian across, Gaussian along, normalised so that a straight line of Gaussian profile with
/// the filter's own width and height 1 gives 1. The noise is as `set_noise` finds it. Filtered by tiles: time grows
/// with the pixels and nothing else.
/// @param is_inside  CV_8U, not 0 where the texture is the cell's; nothing outside of it counts as texture
Ridges find_ridges(const cv::Mat& image, const cv::Mat& is_inside, const RidgeScales& scales, int n_directions = 16);

/// The responses alone, without noise.
Ridges find_ridges(const cv::Mat& image, const RidgeScales& scales, int n_directions = 16);

/// The noise of these responses from the places that are free of fibres: the greater of the camera's white noise
/// through the filter and the spread of the responses in the texture around.
/// @param is_free  CV_8U, not 0 where the cell's texture is to be seen
void set_noise(Ridges& ridges, const cv::Mat& is_free, double radius_px);

/// Standard deviation of the responses within a disc, of zero mean, as the tail of their distribution has it: filaments
/// of a mesh make few strong responses among many weak ones, and lines of noise begin at the strong ones. Only free
/// places count; where a disc holds too few of them it grows. The lower quartile over the directions, so that bundles
/// that fill a neighbourhood in one direction, or two that cross, do not count as its texture.
cv::Mat texture_of(const std::vector<cv::Mat>& responses, const cv::Mat& is_free, double radius_px);

}  // namespace mbtfm::cells
