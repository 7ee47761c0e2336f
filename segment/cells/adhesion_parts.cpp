#include "segment/cells/adhesion_parts.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "segment/cells/adhesion_regions.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {

namespace {

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
