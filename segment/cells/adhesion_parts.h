/// How far each pixel of an adhesion image stands out, the pixels of each adhesion, and adhesions as blurred elliptical
/// discs. Internal to segment/ (OpenCV types).
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "segment/cells/adhesions.h"
#include "segment/cells/blurred_ellipse.h"
#include "segment/cells/ellipse.h"

namespace mbtfm::cells {

constexpr double kUsualBlur_um = 0.15;       ///< 0.21 · 560 nm / NA 1.2 … 0.9, a little out of focus
constexpr double kWidestBlur_um = 0.2;       ///< a rim that is softer than any optics in focus is the adhesion's own
constexpr double kLeastSmoothing_um = 0.05;  ///< a third of the microscope's blur, which it widens by 6 %
/// The filter matched to the image of the smallest adhesion is as wide as the blur.
constexpr double kMostSmoothing_um = kWidestBlur_um;

/// What an adhesion's pixels are compared to.
struct Contrast {
  double smoothing_um;  ///< standard deviation of the Gaussian
  double coarseness;    ///< blur of the smoothed image over that of one that noise does not trouble
  cv::Mat sharp;        ///< image above the local background
  cv::Mat sharp_noise;  ///< standard deviation of a pixel
  cv::Mat height;       ///< `sharp`, smoothed
  cv::Mat noise;        ///< standard deviation of `height` where there is no adhesion
  double bright;        ///< mean height of what is bright, most of it adhesions
  double floor;         ///< heights below are texture or rounding
  cv::Mat least_seed;   ///< heights below may be a step of the background, as at the edge of a bright cell
};

/// The smoothing is the least, from `kLeastSmoothing_um` to `kMostSmoothing_um`, at which the faintest adhesion that
/// the floor lets through can have a seed:
///
///   adhesion_seed_noise · noise(s) <= adhesion_faintest · typical height(s)
///
/// The noise falls with s and the height hardly, as long as adhesions are wider. Gaps and fringes are wider in a
/// smoothed image, so the background's disc grows as the blur does.
Contrast contrast_of(const cv::Mat& image, double pixel_size_um, const AdhesionParameters& parameters);

/// 255 where the height is that many standard deviations of the noise, and above the floor.
cv::Mat above(const Contrast& contrast, double n_sigma);

/// Everything above its rim that reaches a seed: hysteresis, split where adhesions touch, the rim of each at a share of
/// its own height.
std::vector<std::vector<CoveredPixel>> adhesion_parts(const Contrast& contrast, double pixel_size_um,
                                                      const AdhesionParameters& parameters);

/// Two adhesions that a region may be.
using TwoEllipses = std::array<BlurredEllipse, 2>;

struct FittedEllipse {
  BlurredEllipse ellipse;
  double ground = 0;                 ///< level around it
  bool is_settled = false;           ///< the iteration ended at a minimum that is an ellipse within the window
  double scatter = 0;                ///< mean square of what the model leaves
  double noise = 0;                  ///< mean square of a pixel's noise
  double unexplained = 1;            ///< share of the window's variance, less that of the noise, that the model leaves
  std::optional<TwoEllipses> two{};  ///< the window shows these better than one
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
///
/// Where one ellipse leaves enough, two are fitted, too. They stand if they gain twice the log-likelihood that seven
/// more unknowns may (Schwarz, Ann. Statist. 6:461, 1978), do not lie on each other and neither is too small:
///
///   n (S₁ − S₂) / 2v > 7 ln n,   v = noise² + 4π s² m² B²
///
/// S: mean square left, s: blur. Adhesions are no ellipses: m, the median of the picture's fits, is what is left
/// besides noise over the brightness B, and 4π s² pixels leave the same.
/// @param height   image above its background
/// @param noise    standard deviation of a pixel
/// @param start    with their blur and dome, which stay
/// @param halves   of each, from which two may be fitted
/// @param least_area  px², of each of two
std::vector<FittedEllipse> fit_ellipses(const cv::Mat& height, const cv::Mat& noise,
                                        const std::vector<BlurredEllipse>& start,
                                        const std::vector<std::vector<TwoEllipses>>& halves, double least_area);

}  // namespace mbtfm::cells
