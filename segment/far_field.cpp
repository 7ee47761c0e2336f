#include "segment/far_field.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace mbtfm::segment {
namespace {

/// Sources on a grid inside the frame.
std::vector<Vec2> sources(double width, double height, double margin) {
  const int kSide = getenv("SIDE")?atoi(getenv("SIDE")):6;
  std::vector<Vec2> result;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      result.push_back(
          {margin + (width - 2 * margin) * (i + 0.5) / kSide, margin + (height - 2 * margin) * (j + 0.5) / kSide});
    }
  }
  return result;
}

/// The two rows of a bead: drift x, drift y, then each source's force, less the first source's (so that they balance).
void fill_rows(cv::Mat& rows, Vec2 place, const std::vector<Vec2>& at, double softening) {
  rows = 0;
  rows.at<double>(0, 0) = rows.at<double>(1, 1) = 1;
  cv::Matx22d first;
  for (std::size_t k = 0; k < at.size(); ++k) {
    const Vec2 d = place - at[k];
    const double r = std::sqrt(dot(d, d) + softening * softening);
    const double scale = softening / r, xx = d.x * d.x / (r * r), yy = d.y * d.y / (r * r), xy = d.x * d.y / (r * r);
    const cv::Matx22d kernel(0.5 * scale * (1 + xx), 0.5 * scale * xy, 0.5 * scale * xy, 0.5 * scale * (1 + yy));
    if (k == 0) {
      first = kernel;
      continue;
    }
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) rows.at<double>(a, static_cast<int>(2 * k) + b) = kernel(a, b) - first(a, b);
    }
  }
}

}  // namespace

FarField far_field(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, double width,
                   double height, double margin) {
  const std::vector<Vec2> at = sources(width, height, margin);
  const double softening = (getenv("SOFT")?atof(getenv("SOFT")):1.0)*(width - 2 * margin) / (getenv("SIDE")?atoi(getenv("SIDE")):6);
  const int n = static_cast<int>(2 * at.size());
  cv::Mat normal = cv::Mat::zeros(n, n, CV_64F), right = cv::Mat::zeros(n, 1, CV_64F), rows(2, n, CV_64F);
  std::vector<int> frame;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Vec2 p = positions[k];
    if (std::min({p.x, p.y, width - 1 - p.x, height - 1 - p.y}) >= margin) continue;
    frame.push_back(static_cast<int>(k));
    fill_rows(rows, p, at, softening);
    const cv::Mat u = (cv::Mat_<double>(2, 1) << displacements[k].x, displacements[k].y);
    normal += rows.t() * rows;
    right += rows.t() * u;
  }
  FarField result;
  result.n_beads = static_cast<int>(frame.size());
  if (frame.empty()) return result;
  const double kRidge =
      getenv("RIDGE") ? atof(getenv("RIDGE")) : 1e-3;  // of a force's own diagonal: below it forces fit noise
  for (int k = 2; k < n; ++k) normal.at<double>(k, k) += kRidge * cv::trace(normal)[0] / n;
  cv::Mat solution;
  cv::solve(normal, right, solution, cv::DECOMP_CHOLESKY);
  result.drift = {solution.at<double>(0), solution.at<double>(1)};
  double squares = 0;
  for (const int k : frame) {
    fill_rows(rows, positions[k], at, softening);
    const cv::Mat fitted = rows * solution;
    squares += std::pow(displacements[k].x - fitted.at<double>(0), 2);
    squares += std::pow(displacements[k].y - fitted.at<double>(1), 2);
  }
  result.rms = std::sqrt(0.5 * squares / result.n_beads);
  return result;
}

}  // namespace mbtfm::segment
