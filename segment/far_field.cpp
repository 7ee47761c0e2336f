#include "segment/far_field.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>

namespace mbtfm::segment {
namespace {

/// Sources a side: a twelfth of the inner field (2 to 8 um in an ordinary picture) is about the size of an adhesion,
/// and half of it the patch that the force is spread over.
constexpr int kSide = 12;
constexpr double kSoftening = 0.5;
/// A frame that moves by more than this share of what the whole picture does is not far from the cell.
constexpr double kQuieter = 0.7;
/// Beads beyond this number are left out evenly: 1500 give the drift to a fortieth of a bead's own error.
constexpr std::size_t kMostBeads = 1500;
/// Of a force's mean diagonal: holds back the patterns of forces that the frame does not see.
constexpr double kRidge = 3e-4;

double rms_about(const std::vector<Vec2>& u, const std::vector<int>& used, Vec2 mean) {
  double squares = 0;
  for (const int k : used) squares += dot(u[k] - mean, u[k] - mean);
  return std::sqrt(0.5 * squares / static_cast<double>(used.size()));
}

Vec2 mean_of(const std::vector<Vec2>& u, const std::vector<int>& used) {
  Vec2 sum;
  for (const int k : used) sum += u[k];
  return (1.0 / static_cast<double>(used.size())) * sum;
}

/// Sources on a grid inside the frame.
std::vector<Vec2> sources(double width, double height, double margin) {
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
  std::vector<int> frame;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Vec2 p = positions[k];
    if (std::min({p.x, p.y, width - 1 - p.x, height - 1 - p.y}) < margin) frame.push_back(static_cast<int>(k));
  }
  FarField result;
  if (positions.empty()) return result;
  std::vector<int> all(positions.size());
  std::iota(all.begin(), all.end(), 0);
  const double everywhere = rms_about(displacements, all, mean_of(displacements, all));
  result.is_at_rest =
      !frame.empty() && rms_about(displacements, frame, mean_of(displacements, frame)) < kQuieter * everywhere;
  if (!result.is_at_rest) {
    result.drift = mean_of(displacements, all);
    result.rms = everywhere;
    result.n_beads = static_cast<int>(all.size());
    return result;
  }
  const std::size_t stride = 1 + frame.size() / kMostBeads;
  std::vector<int> used;
  for (std::size_t k = 0; k < frame.size(); k += stride) used.push_back(frame[k]);
  result.n_beads = static_cast<int>(used.size());

  const std::vector<Vec2> at = sources(width, height, margin);
  const double softening = kSoftening * std::min(width - 2 * margin, height - 2 * margin) / kSide;
  const int n = static_cast<int>(2 * at.size());
  cv::Mat design = cv::Mat::zeros(2 * result.n_beads, n, CV_64F), u(2 * result.n_beads, 1, CV_64F);
  for (int k = 0; k < result.n_beads; ++k) {
    cv::Mat rows = design.rowRange(2 * k, 2 * k + 2);
    fill_rows(rows, positions[used[k]], at, softening);
    u.at<double>(2 * k) = displacements[used[k]].x;
    u.at<double>(2 * k + 1) = displacements[used[k]].y;
  }
  cv::Mat normal, solution;
  cv::mulTransposed(design, normal, true);
  const double ridge = kRidge * cv::trace(normal)[0] / n;
  for (int k = 2; k < n; ++k) normal.at<double>(k, k) += ridge;
  cv::solve(normal, design.t() * u, solution, cv::DECOMP_CHOLESKY);
  result.drift = {solution.at<double>(0), solution.at<double>(1)};
  result.rms = cv::norm(u - design * solution) / std::sqrt(2.0 * result.n_beads);
  return result;
}

}  // namespace mbtfm::segment
