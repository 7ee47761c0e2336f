#include "segment/cells/haze.h"

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

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

/// Mean of the values where `where` is not 0, weighted by a Gaussian of the distance.
cv::Mat mean_near(const cv::Mat& values, const cv::Mat& where, double sigma_px) {
  cv::Mat weight, weighted;
  where.convertTo(weight, CV_32F, 1.0 / 255);
  cv::multiply(values, weight, weighted);
  const double overall = cv::mean(values, where)[0];
  constexpr double kFaint = 1e-4;  // of the weight: beyond it the mean of all stands
  return (wide_gaussian(weighted, sigma_px) + kFaint * overall) / (wide_gaussian(weight, sigma_px) + kFaint);
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

}  // namespace

Body without_haze(const cv::Mat& values, const cv::Mat& mask, double pixel_um, double band_um) {
  const double band_px = band_um / pixel_um;
  const cv::Mat far = distance_from(mask) > kFar_bands * band_px;
  if (cv::countNonZero(far) == 0) return {mask, cv::Mat::zeros(mask.size(), CV_8U)};
  cv::Mat opened, plateau;
  cv::morphologyEx(values, opened, cv::MORPH_OPEN, disc_of(kThin_um / pixel_um));
  const cv::Mat ground = mean_near(values, far, kFar_bands * band_px);
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

}  // namespace mbtfm::cells
