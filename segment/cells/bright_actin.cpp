#include "segment/cells/bright_actin.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

/// Of the fibres the middle one's middle height.
double usual_height(const Ridges& ridges, const std::vector<std::vector<cv::Point2d>>& fibres) {
  std::vector<double> heights;
  for (const auto& points : fibres) {
    std::vector<double> of_points;
    for (const cv::Point2d& p : points) of_points.push_back(sample(ridges.strongest, p));
    heights.push_back(numerics::median(std::move(of_points)));
  }
  return numerics::median(std::move(heights));
}

}  // namespace

std::vector<std::vector<cv::Point2d>> bright_crests_beside(const Ridges& ridges, const cv::Mat& is_inside,
                                                           const std::vector<std::vector<cv::Point2d>>& fibres,
                                                           double aside_px, double shortest_px) {
  constexpr std::size_t kEnough = 5;
  if (fibres.size() < kEnough) return {};
  cv::Mat is_explained = cv::Mat::zeros(is_inside.size(), CV_8U);
  for (const auto& points : fibres)
    for (const cv::Point2d& p : points)
      cv::circle(is_explained, cv::Point(p), cvCeil(aside_px), cv::Scalar(255), cv::FILLED);
  const double level = usual_height(ridges, fibres);
  cv::Mat crests = cv::Mat::zeros(is_inside.size(), CV_8U), joined, labels;
  for (int y = 1; y + 1 < crests.rows; ++y)
    for (int x = 1; x + 1 < crests.cols; ++x)
      if (is_inside.at<std::uint8_t>(y, x) != 0 && is_explained.at<std::uint8_t>(y, x) == 0 &&
          ridges.strongest.at<float>(y, x) >= level && ridges.is_crest(x, y))
        crests.at<std::uint8_t>(y, x) = 255;
  cv::dilate(crests, joined, cv::Mat());
  const int n = cv::connectedComponents(joined, labels, 8, CV_32S);
  std::vector<std::vector<cv::Point2d>> lines(static_cast<std::size_t>(n));
  for (int y = 0; y < crests.rows; ++y)
    for (int x = 0; x < crests.cols; ++x)
      if (crests.at<std::uint8_t>(y, x) != 0) lines[labels.at<int>(y, x)].emplace_back(x, y);
  std::erase_if(lines, [&](const auto& line) { return static_cast<double>(line.size()) < shortest_px; });
  return lines;
}

}  // namespace mbtfm::cells
