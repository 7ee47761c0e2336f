#include "segment/cells/cell_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <set>
#include <utility>

#include "segment/cells/basins.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

cv::Mat without_debris(const cv::Mat& mask, double smallest) {
  const Parts parts = parts_of(filled(mask), smallest);
  cv::Mat result = cv::Mat::zeros(mask.size(), CV_8U);
  for (const Parts::Part& part : parts.parts) result(part.box) |= parts.labels(part.box) == part.label;
  return result;
}

cv::Mat smoothed(const cv::Mat& mask) {
  cv::Mat smooth;
  cv::GaussianBlur(mask, smooth, cv::Size(0, 0), kMaskSigma_px);
  return smooth > 127;
}

/// Mean of `values` where `mask` is not 0, weighted by a Gaussian of the distance.
/// @param faint, overall  where the mask's weight is no more than the one, the mean is the other
cv::Mat mean_nearby(const cv::Mat& values, const cv::Mat& mask, double sigma_px, double faint = 1e-6,
                    double overall = 0) {
  cv::Mat weight, weighted;
  mask.convertTo(weight, CV_32F, 1.0 / 255);
  cv::multiply(values, weight, weighted);
  return (wide_gaussian(weighted, sigma_px) + faint * overall) / (wide_gaussian(weight, sigma_px) + faint);
}

/// One round of comparing points near the edge with both sides. "Inside" is what the cell looks like along its edge:
/// brighter things, its thick middle, fibres and adhesions, count no more than that.
cv::Mat moved_edge(const cv::Mat& values, const cv::Mat& mask, double band_px, double smallest) {
  cv::Mat grown, core, result = mask.clone();
  cv::dilate(mask, grown, disc_of(band_px));
  cv::erode(mask, core, disc_of(band_px), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  const cv::Mat clipped = cv::min(values, median_within(values, mask & ~core));
  const cv::Mat middle = (mean_nearby(clipped, mask, band_px) + mean_nearby(clipped, ~mask, band_px)) / 2;
  const cv::Mat brighter = clipped > middle, band = grown & ~core;
  brighter.copyTo(result, band);
  return without_debris(smoothed(result), smallest);
}

constexpr double kFar_bands = 3;      // from the mask: haze has fallen to a tenth, a twentieth of the half that matters
constexpr double kThin_um = 0.8;      // radius: twice the width of a fibre, and of what blur leaves of a filopodium
constexpr double kSoft_um = 1;        // an edge softer than this is out of focus: in focus the blur is 0.1 to 0.3 um
constexpr double kNear_um = 1;        // of the mask's edge: it may lie so far off
constexpr double kPlateau_bands = 2;  // inwards: twice the widest blur at which an image is worth segmenting
constexpr double kHalf = 0.5;
constexpr double kLong_bands = 3;  // along the edge: a tall cell's haze is all around, a dim place of the lamella short

cv::Mat distance_from(const cv::Mat& mask) {
  cv::Mat distance;
  cv::distanceTransform(~mask, distance, cv::DIST_L2, 5);
  return distance;
}

/// Where the light is nowhere near as steep as behind the blur `kSoft_um`.
cv::Mat is_soft(const cv::Mat& light, double pixel_um) {
  // half-way up an edge behind a Gaussian blur s the slope over the height is 2 / (sqrt(2 pi) s)
  const double steepest_per_um = 2 / (std::sqrt(2 * std::numbers::pi) * kSoft_um);
  cv::Mat dx, dy, slope, sharp;
  cv::Sobel(light, dx, CV_32F, 1, 0, 3, 1 / (8 * pixel_um), 0, cv::BORDER_REFLECT);
  cv::Sobel(light, dy, CV_32F, 0, 1, 3, 1 / (8 * pixel_um), 0, cv::BORDER_REFLECT);
  cv::magnitude(dx, dy, slope);
  cv::dilate(slope > light * steepest_per_um, sharp, disc_of(kNear_um / pixel_um));
  return ~sharp;
}

/// The parts of `area` that have `least` pixels or more of the mask's edge, most of them soft.
cv::Mat hazy_parts(const cv::Mat& area, const cv::Mat& mask, const cv::Mat& soft, double least) {
  cv::Mat labels, core, result = cv::Mat::zeros(area.size(), CV_8U);
  cv::erode(mask, core, disc_of(1), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  const int n = cv::connectedComponents(area, labels, 8, CV_32S);
  std::vector<int> n_edge(static_cast<std::size_t>(n), 0), n_soft = n_edge;
  for (int y = 0; y < area.rows; ++y)
    for (int x = 0; x < area.cols; ++x) {
      if (core.at<uchar>(y, x)) continue;
      const auto label = static_cast<std::size_t>(labels.at<int>(y, x));
      ++n_edge[label];
      n_soft[label] += soft.at<uchar>(y, x) > 0;
    }
  for (int y = 0; y < area.rows; ++y)
    for (int x = 0; x < area.cols; ++x)
      if (const auto label = static_cast<std::size_t>(labels.at<int>(y, x)); label > 0 && n_edge[label] >= least)
        result.at<uchar>(y, x) = 2 * n_soft[label] > n_edge[label] ? 255 : 0;
  return result;
}

/// The mask of a cell less the rim of light around it that the cell's blur makes.
///
/// A blur that is even in all directions, however wide, leaves half of a cell's height at its edge: the height over the
/// ground far away (I − B), against the height that the cell reaches further in (P − B). Beginning at the mask's
/// edge, points below half of it are taken off, until none is left:
///
///   I − B < (P − B) / 2
///
/// - B: the mean of the image well beyond the mask's reach, as it is near this place.
/// - I: the image opened by a disc wider than fibres and filopodia, which are neither rim nor plateau.
/// - P: the greatest I within two bands in the mask, but no more than the mask's median: the edge of a cell's thick
/// middle
///   is not the edge of the cell.
///
/// It begins only where the mask ends in haze: along three bands of its edge or more, most of it soft. Soft is an
/// edge whose height falls as behind a blur of a micrometre or more. A sharp edge stays, however dim the lamella
/// is that it ends.
/// @param values   grey values, smoothed
/// @param mask     255 in cells, 0 outside
/// @param band_um  > 0
/// @returns the mask itself, and nothing soft, where all of the image lies near a cell: there the ground is not known
Body without_haze(const cv::Mat& values, const cv::Mat& mask, double pixel_um, double band_um) {
  const double band_px = band_um / pixel_um;
  const cv::Mat far = distance_from(mask) > kFar_bands * band_px;
  if (cv::countNonZero(far) == 0) return {mask, cv::Mat::zeros(mask.size(), CV_8U)};
  cv::Mat opened, plateau;
  cv::morphologyEx(values, opened, cv::MORPH_OPEN, disc_of(kThin_um / pixel_um));
  constexpr double kFaint = 1e-4;  // of the weight: beyond it the mean of all stands
  const cv::Mat ground = mean_nearby(values, far, kFar_bands * band_px, kFaint, cv::mean(values, far)[0]);
  const cv::Mat height = opened - ground, soft = is_soft(values - ground, pixel_um);
  cv::Mat body = mask;
  constexpr int kRounds = 4;  // the median of what is left rises once or twice
  for (int round = 0; round < kRounds; ++round) {
    cv::Mat within = cv::Mat::zeros(mask.size(), CV_32F);
    height.copyTo(within, body);
    cv::dilate(cv::Mat(cv::min(within, median_within(height, body))), plateau, disc_of(kPlateau_bands * band_px));
    const cv::Mat dim = (height < plateau * kHalf) & body;
    const cv::Mat rim = hazy_parts(dim, body, soft, kLong_bands * band_px);
    if (cv::countNonZero(rim) == 0) break;
    body = body & ~rim;
  }
  return {body, soft};
}

}  // namespace

Parts parts_of(const cv::Mat& mask, double smallest) {
  Parts result;
  cv::Mat stats, centroids;
  const int n = cv::connectedComponentsWithStats(mask, result.labels, stats, centroids, 4, CV_32S);
  for (int i = 1; i < n; ++i) {
    const auto of = [&](int column) { return stats.at<int>(i, column); };
    const cv::Rect box(of(cv::CC_STAT_LEFT), of(cv::CC_STAT_TOP), of(cv::CC_STAT_WIDTH), of(cv::CC_STAT_HEIGHT));
    if (of(cv::CC_STAT_AREA) >= smallest) result.parts.push_back({i, of(cv::CC_STAT_AREA), box});
  }
  std::stable_sort(result.parts.begin(), result.parts.end(),
                   [](const Parts::Part& a, const Parts::Part& b) { return a.n_pixels > b.n_pixels; });
  return result;
}

cv::Mat first_mask(const cv::Mat& image, double noise, const cv::Mat& within) {
  const double dark = quantile(image, 0.01), bright = quantile(image, 0.99);
  // neither noise (three deviations) nor a twentieth of the range shall spread over the logarithm's steep part
  const double unit = std::max(3 * noise, 0.05 * (bright - dark));
  if (unit <= 0) return cv::Mat::zeros(image.size(), CV_8U);
  cv::Mat compressed = cv::max((image - dark) / unit, 0.0) + 1.0, bytes, unused;
  cv::log(compressed, compressed);
  cv::normalize(compressed, bytes, 0, 255, cv::NORM_MINMAX, CV_8U);
  std::vector<uchar> values(bytes.begin<uchar>(), bytes.end<uchar>());
  if (!within.empty()) {
    values.clear();
    for (std::size_t i = 0; i < within.total(); ++i)
      if (within.data[i]) values.push_back(bytes.data[i]);
  }
  return bytes > cv::threshold(values, unused, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
}

cv::Mat holes_in(const cv::Mat& values, const cv::Mat& mask, double band_px, double noise, double smallest) {
  cv::Mat core;
  cv::erode(mask, core, disc_of(band_px), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  // from far away: the holes are in the middle
  const cv::Mat outside = mean_nearby(values, ~mask, 4 * band_px),
                edge = mean_nearby(values, mask & ~core, 4 * band_px);
  const cv::Mat rise = edge - outside, height = values - outside;
  cv::Mat quarter;
  cv::min(cv::Mat(rise * 0.25), cv::Mat(rise - 4 * noise), quarter);
  const cv::Mat dark = (height < rise * 0.5) & mask, darkest = (height < quarter) & mask;
  cv::Mat result = cv::Mat::zeros(mask.size(), CV_8U);
  const Parts gaps = parts_of(dark, smallest);
  const cv::Rect frame(cv::Point(0, 0), mask.size());
  for (const Parts::Part& gap : gaps.parts) {
    const cv::Rect box = cv::Rect(gap.box.tl() - cv::Point(1, 1), gap.box.br() + cv::Point(1, 1)) & frame;
    const cv::Mat hole = gaps.labels(box) == gap.label;
    cv::Mat rim;
    cv::dilate(hole, rim, disc_of(1));
    // a gap that reaches the edge is no hole
    if (cv::countNonZero(rim & ~mask(box)) == 0 && 2 * cv::countNonZero(hole & darkest(box)) > gap.n_pixels)
      result(box) |= hole;
  }
  return result;
}

Body cells_in(const Scene& s, const cv::Mat& bright, double smallest) {
  cv::Mat mask = without_debris(bright, smallest);
  if (cv::countNonZero(mask) == 0 || cv::countNonZero(~mask) == 0) return {};
  // two halves of pure noise differ by 1.6 standard deviations
  if (cv::mean(s.smooth, mask)[0] - cv::mean(s.smooth, ~mask)[0] < 4 * s.noise) return {};
  constexpr int kRounds = 6;  // the edge moves by up to a band in the first few and then stays
  for (int round = 0; round < kRounds && cv::countNonZero(mask) > 0; ++round) {
    const cv::Mat before = mask;
    mask = moved_edge(s.smooth, mask, s.band_px, smallest);
    // less than a pixel in a thousand of the cell: what still changes is noise
    if (cv::countNonZero(before ^ mask) * 1000 < cv::countNonZero(mask)) break;
  }
  Body body = without_haze(s.smooth, mask, s.pixel_um, kBand_um);
  if (cv::countNonZero(body.mask ^ mask) > 0) mask = without_debris(smoothed(body.mask), smallest);
  return {mask, body.soft};
}

namespace {

constexpr double kLeastShare = 0.15;  // of the area of both: cells of one kind differ in area by less than six times

struct Meeting {
  int a, b, pixel;  ///< two basins that met at a neck, and where
};

}  // namespace

CutMask cut_at_necks(const cv::Mat& mask, double narrow, double smallest) {
  CutMask result{mask.clone(), cv::Mat::zeros(mask.size(), CV_8U), {}};
  cv::Mat distance;
  cv::distanceTransform(mask, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const std::vector<int> order = pixels_from_the_highest(distance, mask);
  const auto distance_at = [&](int i) { return distance.at<float>(i / mask.cols, i % mask.cols); };
  const auto neighbours_of = [&](int i) {
    const int x = i % mask.cols, y = i / mask.cols;
    return std::array{x > 0 ? i - 1 : -1, x + 1 < mask.cols ? i + 1 : -1, y > 0 ? i - mask.cols : -1,
                      y + 1 < mask.rows ? i + mask.cols : -1};
  };
  Basins basins(mask.total());
  std::vector<Meeting> meetings;
  for (const int i : order) {
    const std::array<int, 4> around = neighbours_of(i);
    basins.add(i, distance_at(i), std::ranges::find(around, -1) != around.end());
    for (const int j : around) {
      if (j < 0 || !basins.has(j)) continue;
      const int own = basins.of(i), other = basins.of(j);
      if (own == other) continue;
      if (distance_at(i) < narrow * std::min(basins.peak(own), basins.peak(other)))
        meetings.push_back({own, other, i});
      else
        basins.join(own, other);
    }
  }
  // What is too small for a cell is a part of what it hangs on, the widest way first.
  for (bool is_changed = true; is_changed;) {
    is_changed = false;
    for (const Meeting& m : meetings) {
      const int a = basins.of(m.a), b = basins.of(m.b);
      const int less = basins.n_pixels(a) < basins.n_pixels(b) ? a : b;
      const double n = basins.n_pixels(less), both = basins.n_pixels(a) + basins.n_pixels(b);
      if (a == b || (n >= smallest && (basins.is_cut(less) || n >= kLeastShare * both))) continue;
      basins.join(a, b);
      is_changed = true;
    }
  }
  std::set<std::pair<int, int>> cut;
  for (const Meeting& m : meetings) {
    const int a = basins.of(m.a), b = basins.of(m.b);
    if (a == b || !cut.insert(std::minmax({a, b})).second) continue;
    result.necks.push_back({{m.pixel % mask.cols, m.pixel / mask.cols}, 2.0 * distance_at(m.pixel)});
  }
  for (const int i : order)
    for (const int j : neighbours_of(i))
      if (j >= 0 && basins.has(j) && basins.of(j) < basins.of(i)) result.cuts.data[i] = 255;
  result.mask &= ~result.cuts;
  return result;
}

}  // namespace mbtfm::cells
