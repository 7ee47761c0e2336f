#include "segment/cells/adhesion_contrast.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <vector>

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

/// Sums over the bright pixels of one spot.
struct Spot {
  double area_px = 0, height = 0, square = 0, noise = 0;
  double mean() const { return square / height; }
};

/// Specks of dye and hot pixels set no level for adhesions: a spot far brighter than most does not count. No spot has
/// more than a twentieth of the vote on what most are, however large it is.
Bright bright_of(const Contrast& c, double seed_noise) {
  cv::Mat labels;
  const cv::Mat bright = c.height > 2 * seed_noise * c.noise;
  std::vector<Spot> spots(static_cast<std::size_t>(cv::connectedComponents(bright, labels)));
  for (int y = 0; y < c.height.rows; ++y)
    for (int x = 0; x < c.height.cols; ++x) {
      if (!bright.at<uchar>(y, x)) continue;
      const double height = c.height.at<float>(y, x);
      Spot& spot = spots[static_cast<std::size_t>(labels.at<int>(y, x))];
      ++spot.area_px;
      spot.height += height;
      spot.square += height * height;
      spot.noise += height * c.noise.at<float>(y, x);
    }
  std::erase_if(spots, [](const Spot& s) { return s.height <= 0; });  // the background among them
  std::ranges::sort(spots, {}, &Spot::mean);
  const auto sum_of = [](const std::vector<Spot>& all, const auto& member) {
    double sum = 0;
    for (const Spot& s : all) sum += std::invoke(member, s);
    return sum;
  };
  constexpr double kMostVote = 0.05;
  constexpr double kFar = 5;  // adhesions differ by a quarter to a half (log sd): three of them and more
  const double most = kMostVote * sum_of(spots, &Spot::area_px);
  const auto vote = [&](const Spot& s) { return std::min(s.area_px, most); };
  const double half = sum_of(spots, vote) / 2;
  double before = 0;
  for (const Spot& s : spots) {
    before += vote(s);
    if (before < half) continue;
    const double far = kFar * s.mean();
    std::erase_if(spots, [&](const Spot& other) { return other.mean() > far; });
    break;
  }
  const double height = sum_of(spots, &Spot::height);
  return height > 0 ? Bright{sum_of(spots, &Spot::square) / height, sum_of(spots, &Spot::noise) / height} : Bright{};
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
