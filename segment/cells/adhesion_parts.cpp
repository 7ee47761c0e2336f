#include "segment/cells/adhesion_parts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "segment/cells/basins.h"
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
  Contrast c{};
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
  c.bright = bright.height;
  c.floor = std::max(p.adhesion_faintest * bright.height, 1e-5 * std::max(std::abs(darkest), std::abs(brightest)));
  return c;
}

cv::Mat above(const Contrast& c, double n_sigma) {
  const cv::Mat level = cv::max(c.noise * n_sigma, c.floor);
  return c.height > level;
}

namespace {

struct SplitRule {
  double depth = 0.25;     ///< share of the lower of two maxima
  double smallest_px = 1;  ///< a region with fewer pixels joins its neighbour
};

/// Connected pixels (4-neighbours) where `mask` is not 0, split by flooding from the highest pixel down: where two
/// regions meet they stay apart if the dip between them is deeper than the rule's share of the lower maximum and than
/// three standard deviations of the noise there, and both are large enough.
/// @returns labels from 1 (CV_32S), 0 outside
cv::Mat split_regions(const cv::Mat& height, const cv::Mat& noise, const cv::Mat& mask, const SplitRule& rule) {
  Basins basins(height.total());
  for (const int pixel : pixels_from_the_highest(height, mask)) {
    const int x = pixel % height.cols, y = pixel / height.cols;
    const float level = height.at<float>(y, x);
    int own = -1;
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const int u = x + dx, v = y + dy;
      if (u < 0 || v < 0 || u >= height.cols || v >= height.rows || !basins.has(v * height.cols + u)) continue;
      int other = basins.of(v * height.cols + u);
      if (own < 0 || own == other) {
        own = other;
        continue;
      }
      if (basins.peak(other) > basins.peak(own)) std::swap(own, other);
      const double dip = basins.peak(other) - level;
      const double needed = std::max<double>(rule.depth * basins.peak(other), 3 * noise.at<float>(y, x));
      if (dip < needed || basins.n_pixels(other) < rule.smallest_px) basins.join(own, other);
    }
    basins.add(pixel, level);
    if (own >= 0) basins.join(own, pixel);
  }
  cv::Mat labels(height.size(), CV_32S, cv::Scalar(0));
  std::vector<int> name(height.total(), 0);  // roots renamed 1, 2, … in raster order
  int n_names = 0;
  for (int i = 0; i < static_cast<int>(height.total()); ++i) {
    if (!basins.has(i)) continue;
    int& own = name[basins.of(i)];
    if (own == 0) own = ++n_names;
    labels.at<int>(i / height.cols, i % height.cols) = own;
  }
  return labels;
}

/// The pixels of one region and a margin around it.
struct Patch {
  cv::Rect box;
  int label;
};

std::vector<Patch> patches_of(const cv::Mat& labels, int margin) {
  double n = 0;
  cv::minMaxLoc(labels, nullptr, &n);
  std::vector<cv::Rect> boxes(static_cast<std::size_t>(n) + 1);
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x)
      if (const int label = labels.at<int>(y, x)) boxes[label] |= cv::Rect(x, y, 1, 1);
  std::vector<Patch> patches;
  const cv::Rect frame(cv::Point(0, 0), labels.size());
  for (int label = 1; label <= static_cast<int>(n); ++label) {
    const cv::Rect grown =
        cv::Rect(boxes[label].tl() - cv::Point(margin, margin), boxes[label].br() + cv::Point(margin, margin));
    patches.push_back({grown & frame, label});
  }
  return patches;
}

/// The greatest of the noisy heights near a place lies above the adhesion's own: by 1.3 standard deviations for five
/// independent ones, and by half more as bright pixels have more shot noise than the ground.
constexpr double kLift = 2;
/// Of the reference height of a rim: three deviations of the blur, so that a bright neighbour further off is none.
constexpr double kLevelRadius_um = 0.4;

/// Height above the rim's level, positive inside: the level is a share of the greatest height near, within the region.
cv::Mat excess_over_rim(const Contrast& c, const cv::Mat& labels, const Patch& patch, double radius_px,
                        const AdhesionParameters& p) {
  cv::Mat inside = labels(patch.box) == patch.label, own, greatest;
  c.height(patch.box).copyTo(own, inside);
  cv::dilate(own, greatest, disc_of(radius_px));
  if (c.coarseness > 1) greatest -= c.noise(patch.box) * kLift;  // else noise is no tenth of the height
  const cv::Mat faintest = cv::max(c.noise(patch.box) * p.adhesion_rim_noise, c.floor);
  return c.height(patch.box) - cv::max(greatest * p.adhesion_rim_level, faintest);
}

/// The share of a pixel on the positive side of the level set: its distance to the pixel's centre, in pixels, plus ½.
double share_of(const cv::Mat& excess, int x, int y) {
  const auto at = [&](int column, int row) {
    return excess.at<float>(std::clamp(row, 0, excess.rows - 1), std::clamp(column, 0, excess.cols - 1));
  };
  const double slope = std::hypot((at(x + 1, y) - at(x - 1, y)) / 2, (at(x, y + 1) - at(x, y - 1)) / 2);
  const double value = at(x, y);
  if (slope <= 1e-12 * std::abs(value)) return value > 0 ? 1 : 0;
  return std::clamp(0.5 + value / slope, 0.0, 1.0);
}

/// The region's parts above their rim, each as covered pixels.
std::vector<std::vector<CoveredPixel>> parts_of(const cv::Mat& image_above_background, const cv::Mat& labels,
                                                const Patch& patch, const cv::Mat& excess) {
  cv::Mat core, parts;
  cv::bitwise_and(labels(patch.box) == patch.label, excess > 0, core);
  core = filled(core);
  const int n = cv::connectedComponents(core, parts, 4, CV_32S);
  std::vector<std::vector<CoveredPixel>> result;
  for (int part = 1; part < n; ++part) {
    const cv::Mat inside = parts == part;
    cv::Mat grown;
    cv::dilate(inside, grown, cv::getStructuringElement(cv::MORPH_CROSS, cv::Size(3, 3)));
    std::vector<CoveredPixel> pixels;
    for (int y = 0; y < core.rows; ++y)
      for (int x = 0; x < core.cols; ++x) {
        if (!grown.at<uchar>(y, x)) continue;
        const bool is_core = inside.at<uchar>(y, x);
        const int label = labels.at<int>(patch.box.y + y, patch.box.x + x);
        if (!is_core && label != 0 && label != patch.label) continue;  // a neighbour's
        // a filled hole counts whole; other pixels by the level set, whose sign says on which side the centre is
        const double share = is_core && excess.at<float>(y, x) <= 0 ? 1 : share_of(excess, x, y);
        if (share > 0)
          pixels.push_back({patch.box.x + x, patch.box.y + y, share,
                            image_above_background.at<float>(patch.box.y + y, patch.box.x + x)});
      }
    result.push_back(std::move(pixels));
  }
  return result;
}

bool reaches_seed(const std::vector<CoveredPixel>& pixels, const cv::Mat& seeds) {
  return std::any_of(pixels.begin(), pixels.end(),
                     [&](const CoveredPixel& p) { return p.share > 0.5 && seeds.at<uchar>(p.row, p.column); });
}

}  // namespace

std::vector<std::vector<CoveredPixel>> adhesion_parts(const Contrast& c, double pixel_size_um,
                                                      const AdhesionParameters& p) {
  const cv::Mat seeds = above(c, p.adhesion_seed_noise) & (c.height > c.least_seed);
  const double pixel_um2 = pixel_size_um * pixel_size_um, radius_px = kLevelRadius_um / pixel_size_um;
  const SplitRule rule{.depth = p.adhesion_split_depth, .smallest_px = p.adhesion_smallest_um2 / pixel_um2 / 2};
  const cv::Mat labels = split_regions(c.height, c.noise, above(c, p.adhesion_rim_noise), rule);
  std::vector<std::vector<CoveredPixel>> result;
  for (const Patch& patch : patches_of(labels, 2)) {
    if (cv::countNonZero(seeds(patch.box)) == 0) continue;
    const cv::Mat excess = excess_over_rim(c, labels, patch, radius_px, p);
    for (auto& pixels : parts_of(c.height, labels, patch, excess))
      if (reaches_seed(pixels, seeds)) result.push_back(std::move(pixels));
  }
  return result;
}

}  // namespace mbtfm::cells
