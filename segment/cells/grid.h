/// Work on images as matrices: background, noise, sampling. Internal to segment/ (OpenCV types).
/// Matrix coordinates: (column, row), pixel centres at whole numbers.
#pragma once

#include <opencv2/core.hpp>

#include "pipeline/contract/geometry.h"
#include "segment/images/image.h"

namespace mbtfm::cells {

/// The image as a float matrix that shares its pixels. Not-a-number and infinite pixels are an InvalidData.
cv::Mat matrix_of(const images::Image& image);

/// A matrix point in um: pixel (i, j) has its centre at (i + 1/2, j + 1/2) pixels.
inline Vec2 to_um(cv::Point2d point, double pixel_um) {
  return {(point.x + 0.5) * pixel_um, (point.y + 0.5) * pixel_um};
}
inline cv::Point2d to_pixels(Vec2 point_um, double pixel_um) {
  return {point_um.x / pixel_um - 0.5, point_um.y / pixel_um - 0.5};
}

/// Mean over blocks of factor × factor pixels; the last column and row are repeated where the size is no multiple.
cv::Mat shrink(const cv::Mat& image, int factor);

cv::Mat gaussian(const cv::Mat& image, double sigma_px);

/// The same to about a hundredth, evaluated on a grid of two fifths of the standard deviation and interpolated.
cv::Mat wide_gaussian(const cv::Mat& image, double sigma_px);

/// Standard deviation left by `gaussian` of white noise of standard deviation 1.
double noise_gain(double sigma_px);

/// Median over a disc, evaluated on a grid of a quarter of the radius and interpolated. Edges between two grey levels
/// stay where they are; objects that fill less than half of the disc vanish.
cv::Mat local_median(const cv::Mat& image, double radius_px);

/// Magnitudes of second differences in both directions, which cancel everything smooth, in units of a pixel's white
/// noise (Immerkaer, CVIU 64:300, 1996; the kernel's norm is 6).
cv::Mat noise_magnitude(const cv::Mat& image);

/// Standard deviation of the white noise of each pixel, from second differences in both directions, which cancel
/// everything smooth (Immerkaer 1996), as a local median over a disc.
cv::Mat local_noise(const cv::Mat& image, double radius_px);

/// The same over the whole image.
double overall_noise(const cv::Mat& image);

/// Difference of the greatest and the least block mean over a square of this half side, on a grid of a quarter of it.
cv::Mat local_range(const cv::Mat& image, double radius_px);

/// Local robust standard deviation of a matrix of zero mean: 1.4826 times the median of its magnitude over a disc.
cv::Mat local_spread(const cv::Mat& residual, double radius_px);

/// The value below which a fraction `q` of the elements lies.
float quantile(const cv::Mat& values, double q);

/// Median of the values where the mask is not 0; 0 where it is nowhere.
double median_within(const cv::Mat& values, const cv::Mat& mask);

/// A mask with its holes filled.
cv::Mat filled(const cv::Mat& mask);

/// A disc for dilation and erosion, of a pixel at least.
cv::Mat disc_of(double radius_px);

/// Bilinear sample; outside the matrix the nearest pixel.
float sample(const cv::Mat& image, cv::Point2d point);

}  // namespace mbtfm::cells
