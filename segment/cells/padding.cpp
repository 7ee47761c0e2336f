#include "segment/cells/padding.h"

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "pipeline/numerics/thin_plate.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

constexpr int kBlend_px = 2;  // interpolation mixes the recorded pixels at the edge with the padding

/// Does this mask fill a convex polygon of few sides, to a pixel?
bool is_polygon(const cv::Mat& mask) {
  constexpr std::size_t kMostSides = 12;  // a rectangle cut by two others
  constexpr double kStraight_px = 1.5, kFull = 0.995;
  std::vector<std::vector<cv::Point>> rings;
  cv::findContours(mask, rings, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
  if (rings.empty()) return false;
  const auto& largest = *std::ranges::max_element(rings, {}, [](const auto& ring) { return cv::contourArea(ring); });
  std::vector<cv::Point> hull, polygon;
  cv::convexHull(largest, hull);
  cv::approxPolyDP(hull, polygon, kStraight_px, true);
  cv::Mat whole = cv::Mat::zeros(mask.size(), CV_8U);
  cv::fillConvexPoly(whole, hull, cv::Scalar(255));
  return polygon.size() <= kMostSides &&
         cv::countNonZero(mask & whole) >= std::max(kFull * cv::countNonZero(whole), kFull * cv::countNonZero(mask));
}

}  // namespace

cv::Mat padding_in(const cv::Mat& image) {
  constexpr double kLeastSeen = 0.25, kFew = 0.5;
  const int right = image.cols - 1, bottom = image.rows - 1;
  cv::Mat padding = cv::Mat::zeros(image.size(), CV_8U);
  for (const cv::Point corner :
       {cv::Point(0, 0), cv::Point(right, 0), cv::Point(0, bottom), cv::Point(right, bottom)}) {
    if (padding.at<uchar>(corner)) continue;
    cv::Mat framed = cv::Mat::zeros(image.rows + 2, image.cols + 2, CV_8U);
    constexpr int kExactly = 4 | cv::FLOODFILL_MASK_ONLY | (255 << 8);
    cv::Mat unchanged = image;
    const int n = cv::floodFill(unchanged, framed, corner, {}, nullptr, {}, {}, kExactly);
    if (2 * n < std::min(image.cols, image.rows)) continue;  // less than half a line: pixels that are equal by chance
    const cv::Mat part = framed(cv::Rect({1, 1}, image.size()));
    cv::Mat near;
    cv::dilate(part, near, disc_of(2 * kBlend_px));
    near &= ~part;
    const cv::Mat equal = (image == image.at<float>(corner)) & near;
    if (cv::countNonZero(equal) <= kFew * cv::countNonZero(near)) padding |= part;
  }
  const int n = cv::countNonZero(padding);
  const bool is_padded = n > 0 && n <= (1 - kLeastSeen) * static_cast<double>(image.total()) && is_polygon(~padding);
  return is_padded ? padding : cv::Mat();
}

cv::Mat without_padding(const cv::Mat& image, const cv::Mat& padding) {
  if (padding.empty()) return image;
  cv::Mat unsure, distance, labels;
  cv::dilate(padding, unsure, disc_of(kBlend_px));
  cv::distanceTransform(unsure, distance, labels, cv::DIST_L2, 5, cv::DIST_LABEL_PIXEL);
  std::vector<float> value(image.total() + 1, 0);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      if (!unsure.at<uchar>(y, x)) value[labels.at<int>(y, x)] = image.at<float>(y, x);
  cv::Mat filled = image.clone();
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      if (unsure.at<uchar>(y, x)) filled.at<float>(y, x) = value[labels.at<int>(y, x)];
  return filled;
}

cv::Mat without_clipping(const cv::Mat& image, const cv::Mat& is_clipped, double widest_px) {
  const int n = cv::countNonZero(is_clipped);
  if (n == 0 || n == static_cast<int>(image.total())) return image;
  constexpr double kFaintest = 0.05;   // of the clipped height: the logarithm of less is noise
  constexpr double kHighGround = 0.5;  // of the range: where bundles merge no ground is to be seen
  const int factor = std::max(1, cvRound(widest_px / 8));
  double darkest = 0, level = 0;
  cv::minMaxLoc(image, &darkest, &level);
  cv::Mat ground;
  cv::morphologyEx(shrink(image, factor), ground, cv::MORPH_OPEN, disc_of(widest_px / factor));
  cv::resize(cv::min(ground, darkest + kHighGround * (level - darkest)), ground, {}, factor, factor, cv::INTER_LINEAR);
  ground = ground(cv::Rect({0, 0}, image.size()));
  cv::Mat height = (image - ground) / (level - ground), relative, depth, from_wide;
  cv::log(cv::max(height, kFaintest), relative);
  // a plateau wider than any bundle is no ridge: a speck of dye or a dead cell has no crest to be found
  cv::distanceTransform(is_clipped, depth, cv::DIST_L2, 5);
  cv::distanceTransform(depth <= 0.5 * widest_px, from_wide, cv::DIST_L2, 5);
  relative.setTo(std::numeric_limits<float>::quiet_NaN(), is_clipped & (from_wide > 0.5 * widest_px));
  auto whole = numerics::plate_through({relative.begin<float>(), relative.end<float>()}, image.cols, 1, 1);
  if (!whole) return image;
  cv::Mat(image.size(), CV_64F, whole->data()).convertTo(relative, CV_32F);
  cv::exp(cv::max(relative, 0), relative);
  cv::Mat result = image.clone();
  cv::Mat(ground + (level - ground).mul(relative)).copyTo(result, is_clipped);
  return result;
}

}  // namespace mbtfm::cells
