#include "segment/beads/coarse_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/numerics/parallel.h"
#include "segment/beads/registration.h"

namespace mbtfm::beads {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;
/// Half a step displaces a bead by its own width 300 px from the centre.
constexpr double kStep_rad = 0.5 * kDegree_rad;
constexpr int kSteps = 60;
constexpr int kMostPixels = 512;  ///< a side: some thousand beads show a turn

/// The middle of the plane, made small where beads stay wider than 0.8 px.
cv::Mat reduced(const Plane& plane, double factor) {
  const cv::Mat whole(plane.height, plane.width, CV_32F, const_cast<float*>(plane.values.data()));
  cv::Mat small;
  cv::resize(whole, small, {}, factor, factor, factor < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
  const int width = std::min(small.cols, kMostPixels), height = std::min(small.rows, kMostPixels);
  return small({(small.cols - width) / 2, (small.rows - height) / 2, width, height}).clone();
}

struct Match {
  double height = 0;
  cv::Point2d shift;
};

Match match_at(double angle_rad, const cv::Mat& spectrum, const cv::Mat& stressed, const cv::Mat& window) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  const double x = 0.5 * (stressed.cols - 1), y = 0.5 * (stressed.rows - 1);
  const cv::Matx23d back(c, -s, x - c * x + s * y, s, c, y - s * x - c * y);
  cv::Mat turned;
  cv::warpAffine(stressed, turned, back, stressed.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  turned = turned.mul(window);
  cv::dft(turned, turned);
  cv::mulSpectrums(turned, spectrum, turned, 0, true);
  cv::idft(turned, turned, cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  Match match;
  cv::Point best;
  cv::minMaxLoc(turned, nullptr, &match.height, nullptr, &best);
  match.shift = cv::Point(best.x > turned.cols / 2 ? best.x - turned.cols : best.x,
                          best.y > turned.rows / 2 ? best.y - turned.rows : best.y);
  return match;
}

}  // namespace

std::optional<Turn> turn_between(const Plane& relaxed, const Plane& stressed, double bead_sigma, int threads) {
  const double wanted = static_cast<double>(kMostPixels) / std::max(relaxed.width, relaxed.height);
  const double factor = std::min(1.0, std::max(wanted, 0.8 / bead_sigma));
  const cv::Mat a = reduced(compressed(relaxed), factor), b = reduced(compressed(stressed), factor);
  cv::Mat window, spectrum;
  cv::createHanningWindow(window, a.size(), CV_32F);
  cv::dft(a.mul(window), spectrum);
  std::vector<Match> matches(2 * kSteps + 1);
  numerics::parallel_for(static_cast<int>(matches.size()), threads,
                         [&](int k) { matches[k] = match_at((k - kSteps) * kStep_rad, spectrum, b, window); });
  int best = 0;
  for (int k = 0; k < static_cast<int>(matches.size()); ++k) {
    if (matches[k].height > matches[best].height) best = k;
  }
  // chance maxima of the other turns differ by a tenth or so; neighbours of the right one share in its peak
  constexpr double kStandsOut = 1.3;
  for (int k = 0; k < static_cast<int>(matches.size()); ++k) {
    if (std::abs(k - best) > 3 && kStandsOut * matches[k].height > matches[best].height) return std::nullopt;
  }
  Turn turn{.angle_rad = (best - kSteps) * kStep_rad,
            .shift = {},
            .centre = {0.5 * (relaxed.width - 1), 0.5 * (relaxed.height - 1)}};
  const cv::Point2d shift = matches[best].shift;  // in the picture turned back
  const double c = std::cos(turn.angle_rad), s = std::sin(turn.angle_rad);
  turn.shift = (1 / factor) * Vec2{c * shift.x - s * shift.y, s * shift.x + c * shift.y};
  return turn;
}

images::Image turned_back(const images::Image& image, const Turn& turn, int threads) {
  const Spline spline = spline_through({image.width, image.height, image.pixels}, threads);
  images::Image result = image;
  in_strips(image.height, threads, [&](int from, int to) {
    for (int j = from; j < to; ++j) {
      for (int i = 0; i < image.width; ++i) result.at(i, j) = value_at(spline, turn.of({1.0 * i, 1.0 * j}));
    }
  });
  return result;
}

}  // namespace mbtfm::beads
