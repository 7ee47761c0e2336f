#include "segment/cells/without_lines.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <unordered_map>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

constexpr double kReach = 2.5;  // standard deviations of the profile: beyond it little is left

/// How one line lies on the image's pixels.
class Ridge {
 public:
  Ridge(const SeenLine& line, cv::Size size) : points_(line.points), height_(line.points.size()) {
    constexpr double kFwhm = 2.3548;
    sigma_px_ = line.width_px / kFwhm;
    const int reach = cvCeil(kReach * sigma_px_);
    struct Nearest {
      double squared = std::numeric_limits<double>::infinity();
      std::size_t point = 0;
    };
    std::unordered_map<int, Nearest> nearest;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const cv::Point middle(cvRound(points_[i].x), cvRound(points_[i].y));
      for (int y = std::max(0, middle.y - reach); y <= std::min(size.height - 1, middle.y + reach); ++y)
        for (int x = std::max(0, middle.x - reach); x <= std::min(size.width - 1, middle.x + reach); ++x) {
          const double dx = x - points_[i].x, dy = y - points_[i].y, squared = dx * dx + dy * dy;
          Nearest& n = nearest[y * size.width + x];
          if (squared < n.squared) n = {squared, i};
        }
    }
    for (const auto& [pixel, n] : nearest)
      if (n.squared < reach * reach)
        stamps_.push_back({pixel, n.point, static_cast<float>(std::exp(-n.squared / (2 * sigma_px_ * sigma_px_)))});
  }

  /// Fit the height to what is left, and take it away.
  void settle(cv::Mat& rest, double averaging_px) {
    std::vector<double> more(points_.size());
    for (std::size_t i = 0; i < points_.size(); ++i) more[i] = height_in(rest, i);
    more = averaged(more, averaging_px);
    for (std::size_t i = 0; i < more.size(); ++i) {
      more[i] = std::max(more[i], -height_[i]);
      height_[i] += more[i];
    }
    float* pixels = rest.ptr<float>();
    for (const Stamp& s : stamps_) pixels[s.pixel] -= s.share * static_cast<float>(more[s.point]);
  }

 private:
  struct Stamp {
    int pixel;
    std::size_t point;
    float share;
  };

  double height_in(const cv::Mat& rest, std::size_t i) const {
    const cv::Point2d d = points_[std::min(i + 3, points_.size() - 1)] - points_[i > 2 ? i - 3 : 0];
    const double l = std::max(1e-9, std::hypot(d.x, d.y));
    const cv::Point2d across(-d.y / l, d.x / l);
    const int n = cvCeil(kReach * sigma_px_);
    double g1 = 0, g2 = 0, r1 = 0, gr = 0;
    for (int k = -n; k <= n; ++k) {
      const double g = std::exp(-k * k / (2 * sigma_px_ * sigma_px_)), r = sample(rest, points_[i] + 1.0 * k * across);
      g1 += g, g2 += g * g, r1 += r, gr += g * r;
    }
    const double m = 2 * n + 1;
    return (gr - g1 * r1 / m) / (g2 - g1 * g1 / m);
  }

  static std::vector<double> averaged(const std::vector<double>& values, double sigma) {
    const int n = static_cast<int>(values.size()), reach = cvCeil(2 * sigma);
    std::vector<double> result(values.size());
    for (int i = 0; i < n; ++i) {
      double sum = 0, weights = 0;
      for (int k = std::max(0, i - reach); k <= std::min(n - 1, i + reach); ++k) {
        const double w = std::exp(-(k - i) * (k - i) / (2 * sigma * sigma));
        sum += w * values[k], weights += w;
      }
      result[i] = sum / weights;
    }
    return result;
  }

  std::vector<cv::Point2d> points_;
  std::vector<double> height_;
  double sigma_px_ = 1;
  std::vector<Stamp> stamps_;
};

}  // namespace

cv::Mat without_lines(const cv::Mat& image, const std::vector<SeenLine>& lines, double averaging_px) {
  constexpr int kRounds = 4;
  cv::Mat rest = image.clone();
  std::vector<Ridge> ridges;
  for (const SeenLine& line : lines) ridges.emplace_back(line, image.size());
  for (int round = 0; round < kRounds; ++round)
    for (Ridge& ridge : ridges) ridge.settle(rest, averaging_px);
  return rest;
}

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
