#include "segment/cells/adhesion_contrast.h"

#include <algorithm>
#include <cmath>

#include "segment/cells/grid.h"

namespace mbtfm::cells {

/// Local noise is taken over this many background radii: enough background among dense adhesions.
constexpr double kNoiseRadius = 2.5;

/// What the median leaves of a step that is blurred and curved, as a share of the step: 0.1 to 0.4 were measured at
/// radii of curvature down to two and a half background radii.
constexpr double kStepLeft = 0.5;

namespace {

/// "Bright": the mean height of what stands clearly out of the noise, weighted by the height itself, so that many faint
/// pixels do not outvote the adhesions; and the noise there.
struct Bright {
  double height = 0, noise = 0;
};

Bright bright_of(const Contrast& c, double seed_noise) {
  double sum = 0, sum_of_squares = 0, noise = 0;
  for (int y = 0; y < c.height.rows; ++y)
    for (int x = 0; x < c.height.cols; ++x) {
      const double height = c.height.at<float>(y, x);
      if (height <= 2 * seed_noise * c.noise.at<float>(y, x)) continue;
      sum += height;
      sum_of_squares += height * height;
      noise += height * c.noise.at<float>(y, x);
    }
  return sum > 0 ? Bright{sum_of_squares / sum, noise / sum} : Bright{};
}

Contrast smoothed_contrast(const cv::Mat& image, double pixel_um, double smoothing_um, const AdhesionParameters& p) {
  Contrast c;
  c.smoothing_um = smoothing_um;
  c.coarseness = std::hypot(kUsualBlur_um, smoothing_um) / std::hypot(kUsualBlur_um, kLeastSmoothing_um);
  const double smoothing_px = std::max(0.5, smoothing_um / pixel_um);
  const double radius_px = std::max(3.0, p.adhesion_background_um * std::max(1.0, c.coarseness) / pixel_um);
  const cv::Mat smooth = gaussian(image, smoothing_px);
  const cv::Mat background = local_median(smooth, radius_px);
  c.sharp = image - background;
  c.height = smooth - background;
  c.least_seed = local_range(background, radius_px) * kStepLeft;
  c.sharp_noise = local_noise(image, kNoiseRadius * radius_px);
  c.noise = cv::max(c.sharp_noise * noise_gain(smoothing_px), local_spread(c.height, kNoiseRadius * radius_px));
  return c;
}

}  // namespace

Contrast contrast_of(const cv::Mat& image, double pixel_um, const AdhesionParameters& p) {
  double smoothing_um = p.adhesion_smoothing_um.value_or(kLeastSmoothing_um);
  Contrast c = smoothed_contrast(image, pixel_um, smoothing_um, p);
  Bright bright = bright_of(c, p.adhesion_seed_noise);
  const auto is_noisy = [&] { return p.adhesion_seed_noise * bright.noise > p.adhesion_faintest * bright.height; };
  constexpr double kStep = 2;  // a step halves white noise
  const Contrast least = c;
  while (!p.adhesion_smoothing_um && smoothing_um < kMostSmoothing_um && (bright.height <= 0 || is_noisy())) {
    smoothing_um = std::min(kStep * smoothing_um, kMostSmoothing_um);
    c = smoothed_contrast(image, pixel_um, smoothing_um, p);
    bright = bright_of(c, p.adhesion_seed_noise);
  }
  if (bright.height <= 0) c = least;  // no smoothing brings anything out
  // an image without noise still has the rounding of float arithmetic: 1e-5 of its brightest value
  double darkest = 0, brightest = 0;
  cv::minMaxLoc(image, &darkest, &brightest);
  c.floor = std::max(p.adhesion_faintest * bright.height, 1e-5 * std::max(std::abs(darkest), std::abs(brightest)));
  return c;
}

cv::Mat above(const Contrast& c, double n_sigma) {
  const cv::Mat level = cv::max(c.noise * n_sigma, c.floor);
  return c.height > level;
}

}  // namespace mbtfm::cells
