#include "segment/outline.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "segment/ellipse.h"
#include "segment/grid.h"

namespace mbtfm::segment {

namespace {

constexpr double kSigma_px = 1.5;  // of the smoothing, in pixels of the working grid: resolves it

cv::Mat largest_filled(const cv::Mat& mask) {
  cv::Mat labels, stats, centroids;
  const int n = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 4, CV_32S);
  int best = 0;
  for (int i = 1; i < n; ++i)
    if (best == 0 || stats.at<int>(i, cv::CC_STAT_AREA) > stats.at<int>(best, cv::CC_STAT_AREA)) best = i;
  if (best == 0) return cv::Mat::zeros(mask.size(), CV_8U);
  // what cannot be reached from a frame around the image is the cell and its holes
  cv::Mat framed;
  cv::copyMakeBorder(labels == best, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::floodFill(framed, cv::Point(0, 0), 128);
  return framed(cv::Rect(1, 1, mask.cols, mask.rows)) != 128;
}

cv::Mat disc_of(double radius_px) {
  const int r = std::max(1, static_cast<int>(std::lround(radius_px)));
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * r + 1, 2 * r + 1));
}

/// Otsu's threshold of log(1 + brightness): cells are bright by a factor, not by an amount.
cv::Mat first_mask(const cv::Mat& image, double noise) {
  const double dark = quantile(image, 0.01), bright = quantile(image, 0.99);
  // neither noise (three deviations) nor a twentieth of the range shall spread over the logarithm's steep part
  const double unit = std::max(3 * noise, 0.05 * (bright - dark));
  if (unit <= 0) return cv::Mat::zeros(image.size(), CV_8U);
  cv::Mat compressed = cv::max((image - dark) / unit, 0.0) + 1.0, bytes, mask;
  cv::log(compressed, compressed);
  cv::normalize(compressed, bytes, 0, 255, cv::NORM_MINMAX, CV_8U);
  cv::threshold(bytes, mask, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
  return largest_filled(mask);
}

/// Mean of `values` where `mask` is not 0, weighted by a Gaussian of the distance.
cv::Mat mean_nearby(const cv::Mat& values, const cv::Mat& mask, double sigma_px) {
  cv::Mat weight, weighted;
  mask.convertTo(weight, CV_32F, 1.0 / 255);
  cv::multiply(values, weight, weighted);
  // 1e-6: far from the mask both are nothing, and the quotient must stay finite
  return gaussian(weighted, sigma_px) / (gaussian(weight, sigma_px) + 1e-6);
}

/// Median of the values where the mask is not 0.
double median_within(const cv::Mat& values, const cv::Mat& mask) {
  std::vector<float> within;
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (mask.at<uchar>(y, x)) within.push_back(values.at<float>(y, x));
  return within.empty() ? 0 : quantile(cv::Mat(within), 0.5);
}

/// One round of comparing points near the edge with both sides. "Inside" is what the cell looks like along its edge:
/// brighter things, its thick middle, fibres and adhesions, count no more than that.
cv::Mat moved_edge(const cv::Mat& values, const cv::Mat& mask, double band_px) {
  cv::Mat grown, core, result = mask.clone(), smooth;
  cv::dilate(mask, grown, disc_of(band_px));
  cv::erode(mask, core, disc_of(band_px), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  const cv::Mat clipped = cv::min(values, median_within(values, mask & ~core));
  const cv::Mat middle = (mean_nearby(clipped, mask, band_px) + mean_nearby(clipped, ~mask, band_px)) / 2;
  const cv::Mat brighter = clipped > middle, band = grown & ~core;
  brighter.copyTo(result, band);
  cv::GaussianBlur(result, smooth, cv::Size(0, 0), kSigma_px);
  return largest_filled(smooth > 127);
}

void add_adhesions(cv::Mat& mask, const std::vector<Adhesion>& adhesions, double pixel_um, double reach_um) {
  cv::Mat distance, labels;
  cv::distanceTransform(~mask, distance, labels, cv::DIST_L2, 5, cv::DIST_LABEL_PIXEL);
  std::vector<cv::Point> cell_pixel(mask.total() + 1);  // the mask's pixel nearest to each point, by label
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (mask.at<uchar>(y, x)) cell_pixel[static_cast<std::size_t>(labels.at<int>(y, x))] = {x, y};
  for (const Adhesion& adhesion : adhesions) {
    const cv::Point2d centre = to_pixels(adhesion.position_um, pixel_um);
    const cv::Point c(std::clamp(cvRound(centre.x), 0, mask.cols - 1), std::clamp(cvRound(centre.y), 0, mask.rows - 1));
    if (distance.at<float>(c) * pixel_um > reach_um) continue;
    const cv::Size axes(cvRound(adhesion.major_axis_um / 2 / pixel_um), cvRound(adhesion.minor_axis_um / 2 / pixel_um));
    cv::ellipse(mask, c, axes, adhesion.angle_rad * 180 / CV_PI, 0, 360, cv::Scalar(255), cv::FILLED);
    // a bridge of five pixels outlives the smoothing of the polygon
    if (distance.at<float>(c) > 0)
      cv::line(mask, c, cell_pixel[static_cast<std::size_t>(labels.at<int>(c))], cv::Scalar(255), 5);
  }
}

/// Points at equal distances along a closed line.
std::vector<cv::Point2d> resampled(const std::vector<cv::Point2d>& closed, double spacing) {
  std::vector<double> at{0};
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const cv::Point2d d = closed[(i + 1) % closed.size()] - closed[i];
    at.push_back(at.back() + std::hypot(d.x, d.y));
  }
  const int n = std::max(8, static_cast<int>(std::lround(at.back() / spacing)));
  std::vector<cv::Point2d> result;
  std::size_t i = 0;
  for (int k = 0; k < n; ++k) {
    const double s = at.back() * k / n;
    while (at[i + 1] < s) ++i;
    const double u = at[i + 1] > at[i] ? (s - at[i]) / (at[i + 1] - at[i]) : 0;
    result.push_back((1 - u) * closed[i] + u * closed[(i + 1) % closed.size()]);
  }
  return result;
}

/// The ½ level of the smoothed mask: boundary pixels moved onto it along its gradient.
std::vector<cv::Point2d> edge_points(const cv::Mat& mask) {
  cv::Mat framed, level;
  constexpr int kFrame = 8;
  cv::copyMakeBorder(mask, framed, kFrame, kFrame, kFrame, kFrame, cv::BORDER_CONSTANT, 0);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(framed, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (contours.empty()) return {};
  framed.convertTo(level, CV_32F, 1.0 / 255);
  level = gaussian(level, kSigma_px);
  std::vector<cv::Point2d> points;
  for (const cv::Point& start : contours[0]) {
    cv::Point2d p = start;
    for (int round = 0; round < 3; ++round) {  // Newton's steps; the level is nearly linear there
      const cv::Point2d gradient(sample(level, p + cv::Point2d(0.5, 0)) - sample(level, p - cv::Point2d(0.5, 0)),
                                 sample(level, p + cv::Point2d(0, 0.5)) - sample(level, p - cv::Point2d(0, 0.5)));
      const double steepness = gradient.dot(gradient), excess = 0.5 - sample(level, p);
      if (steepness < 1e-4) break;
      cv::Point2d step = (excess / steepness) * gradient;
      const double l = std::hypot(step.x, step.y);
      p += l > 1 ? step / l : step;
    }
    points.push_back(p - cv::Point2d(kFrame, kFrame));
  }
  return points;
}

std::vector<cv::Point2d> smoothed_ring(const std::vector<cv::Point2d>& ring, int half_window) {
  const int n = static_cast<int>(ring.size());
  std::vector<cv::Point2d> result(ring.size());
  for (int i = 0; i < n; ++i) {
    cv::Point2d sum(0, 0);
    for (int k = -half_window; k <= half_window; ++k) sum += ring[static_cast<std::size_t>(((i + k) % n + n) % n)];
    result[static_cast<std::size_t>(i)] = sum / (2 * half_window + 1);
  }
  return result;
}

}  // namespace

void declare(ParameterList& list, OutlineParameters& p) {
  list.table("segment");
  list.add("outline_smoothing_um", p.outline_smoothing_um, Range::positive(),
           "smoothing before the outline is looked for (standard deviation, um)");
  list.add("outline_band_um", p.outline_band_um, Range::positive(),
           "distance over which the brightness inside and outside is compared (um)");
  list.add("outline_reach_um", p.outline_reach_um, Range::not_negative(),
           "an adhesion this far outside still belongs to the cell (um)");
  list.add("outline_spacing_um", p.outline_spacing_um, Range::positive(), "distance of the outline's points (um)");
  list.add("outline_smallest_um2", p.outline_smallest_um2, Range::positive(), "least area of a cell (um²)");
}

Polygon find_outline(const Image& image, const std::vector<Adhesion>& adhesions, double pixel_size_um,
                     const OutlineParameters& p) {
  const cv::Mat full = matrix_of(image);
  const int factor = std::max(1, static_cast<int>(p.outline_smoothing_um / (kSigma_px * pixel_size_um)));
  const double pixel_um = pixel_size_um * factor, band_px = std::max(2.0, p.outline_band_um / pixel_um);
  const cv::Mat small = shrink(full, factor), smooth = gaussian(small, p.outline_smoothing_um / pixel_um);
  const double noise = quantile(local_noise(small, band_px), 0.5) * noise_gain(p.outline_smoothing_um / pixel_um);
  cv::Mat mask = first_mask(smooth, noise);
  const double needed_px = p.outline_smallest_um2 / (pixel_um * pixel_um);
  if (cv::countNonZero(mask) < needed_px || cv::countNonZero(~mask) == 0) return {};
  // two halves of pure noise differ by 1.6 standard deviations
  if (cv::mean(smooth, mask)[0] - cv::mean(smooth, ~mask)[0] < 4 * noise) return {};
  constexpr int kRounds = 6;  // the edge moves by up to a band in the first few and then stays
  for (int round = 0; round < kRounds; ++round) {
    const cv::Mat before = mask;
    mask = moved_edge(smooth, mask, band_px);
    // less than a pixel in a thousand of the cell: what still changes is noise
    if (cv::countNonZero(before ^ mask) * 1000 < cv::countNonZero(mask)) break;
  }
  if (cv::countNonZero(mask) < needed_px) return {};
  add_adhesions(mask, adhesions, pixel_um, p.outline_reach_um);
  mask = largest_filled(mask);
  const auto ring = resampled(smoothed_ring(edge_points(mask), 2), p.outline_spacing_um / pixel_um);
  Polygon outline;
  for (const cv::Point2d& point : ring) outline.push_back(to_um(point, pixel_um));
  return outline;
}

std::vector<Adhesion> inside(const Polygon& outline_um, const std::vector<Adhesion>& adhesions) {
  std::vector<Adhesion> kept;
  for (const Adhesion& adhesion : adhesions)
    if (contains(outline_um, adhesion.position_um)) {
      kept.push_back(adhesion);
      kept.back().adhesion_id = static_cast<int>(kept.size());
    }
  return kept;
}

}  // namespace mbtfm::segment
