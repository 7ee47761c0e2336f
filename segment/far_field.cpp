#include "segment/far_field.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <opencv2/core.hpp>
#include <utility>

#include "segment/plane.h"

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

int n_of(Drift kind) { return kind == Drift::translation ? 2 : kind == Drift::rotation ? 3 : 4; }

/// Shift x, shift y, turn, growth; lengths from the centre in units of `scale`, so that all columns weigh alike.
cv::Matx<double, 2, 4> global_columns(Vec2 place, Vec2 centre, double scale) {
  const Vec2 d = (1 / scale) * (place - centre);
  return {1, 0, -d.y, d.x, 0, 1, d.x, d.y};
}

GlobalMotion global_motion(const cv::Mat& solution, int n, Vec2 centre, double scale) {
  const auto value = [&](int k) { return k < n ? solution.at<double>(k) : 0.0; };
  return {{value(0), value(1)}, value(2) / scale, value(3) / scale, centre};
}

/// Least squares over these beads.
GlobalMotion fitted_motion(const std::vector<Vec2>& positions, const std::vector<Vec2>& u, const std::vector<int>& used,
                           Vec2 centre, double scale, Drift kind) {
  const int n = n_of(kind);
  cv::Mat normal = cv::Mat::zeros(n, n, CV_64F), right = cv::Mat::zeros(n, 1, CV_64F), solution;
  for (const int k : used) {
    const auto columns = global_columns(positions[k], centre, scale);
    for (int a = 0; a < n; ++a) {
      for (int b = 0; b < n; ++b)
        normal.at<double>(a, b) += columns(0, a) * columns(0, b) + columns(1, a) * columns(1, b);
      right.at<double>(a) += columns(0, a) * u[k].x + columns(1, a) * u[k].y;
    }
  }
  cv::solve(normal, right, solution, cv::DECOMP_SVD);
  return global_motion(solution, n, centre, scale);
}

double rms_about(const std::vector<Vec2>& positions, const std::vector<Vec2>& u, const std::vector<int>& used,
                 const GlobalMotion& motion) {
  double squares = 0;
  for (const int k : used) {
    const Vec2 rest = u[k] - motion.at(positions[k]);
    squares += dot(rest, rest);
  }
  return std::sqrt(0.5 * squares / static_cast<double>(used.size()));
}

struct Typical {
  GlobalMotion motion;
  double misfit = 0;  ///< median length, px
};

/// What most of these beads do: least squares without those that miss it by more than 2.5 medians, again and again. Of
/// beads that are followed a way they may not go, up to a half are followed to another's place.
Typical typical_motion(const std::vector<Vec2>& positions, const std::vector<Vec2>& u, const std::vector<int>& all,
                       Vec2 centre, double scale, Drift kind) {
  Typical result;
  std::vector<int> used = all;
  for (int round = 0; round < 8; ++round) {
    result.motion = fitted_motion(positions, u, used, centre, scale, kind);
    const auto misfit = [&](int k) { return norm(u[k] - result.motion.at(positions[k])); };
    std::vector<double> misfits;
    for (const int k : all) misfits.push_back(misfit(k));
    result.misfit = quantile(std::move(misfits), 0.5);
    const std::vector<int> before = std::exchange(used, {});
    std::copy_if(all.begin(), all.end(), std::back_inserter(used),
                 [&](int k) { return misfit(k) <= 2.5 * result.misfit; });
    if (used == before) break;
  }
  return result;
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

/// The two rows of a bead: the columns of the drift, then each source's force, less the first source's (so that they
/// balance).
void fill_rows(cv::Mat& rows, Vec2 place, const cv::Matx<double, 2, 4>& global, int n_global,
               const std::vector<Vec2>& at, double softening) {
  for (int a = 0; a < 2; ++a) {
    for (int b = 0; b < n_global; ++b) rows.at<double>(a, b) = global(a, b);
  }
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
    const int column = n_global + 2 * static_cast<int>(k - 1);
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) rows.at<double>(a, column + b) = kernel(a, b) - first(a, b);
    }
  }
}

/// What the drift and the forces inside the frame leave of the beads' motion.
void fit_frame(FarField& result, const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements,
               const std::vector<int>& used, const std::vector<Vec2>& at, double softening, double scale, Drift kind) {
  const int n_global = n_of(kind), n = n_global + 2 * static_cast<int>(at.size() - 1);
  const int n_rows = 2 * static_cast<int>(used.size());
  cv::Mat design = cv::Mat::zeros(n_rows, n, CV_64F), u(n_rows, 1, CV_64F);
  for (int k = 0; k < n_rows / 2; ++k) {
    cv::Mat rows = design.rowRange(2 * k, 2 * k + 2);
    const Vec2 place = positions[used[k]];
    fill_rows(rows, place, global_columns(place, result.drift.centre, scale), n_global, at, softening);
    u.at<double>(2 * k) = displacements[used[k]].x;
    u.at<double>(2 * k + 1) = displacements[used[k]].y;
  }
  cv::Mat normal, solution;
  cv::mulTransposed(design, normal, true);
  const double ridge = kRidge * cv::trace(normal)[0] / n;
  for (int k = n_global; k < n; ++k) normal.at<double>(k, k) += ridge;
  cv::solve(normal, design.t() * u, solution, cv::DECOMP_CHOLESKY);
  result.drift = global_motion(solution, n_global, result.drift.centre, scale);
  const cv::Mat rest = u - design * solution;
  result.rms = cv::norm(rest) / std::sqrt(n_rows);
  if (kind != Drift::translation) {
    cv::Mat unit = cv::Mat::zeros(n, 1, CV_64F), column;
    unit.at<double>(2) = 1;
    cv::solve(normal, unit, column, cv::DECOMP_CHOLESKY);
    result.turn_sigma_rad = result.rms * std::sqrt(column.at<double>(2)) / scale;
  }
  std::vector<double> sizes;
  for (int k = 0; k < n_rows; ++k) sizes.push_back(std::abs(rest.at<double>(k)));
  result.noise = quantile(std::move(sizes), 0.5) / 0.6745;
}

}  // namespace

FarField far_field(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, double width,
                   double height, double margin, Drift kind, double noise) {
  FarField result;
  const double scale = 0.5 * std::min(width, height);
  result.drift.centre = {0.5 * (width - 1), 0.5 * (height - 1)};
  if (positions.empty()) return result;
  std::vector<int> all(positions.size()), frame;
  std::iota(all.begin(), all.end(), 0);
  for (const int k : all) {
    const Vec2 p = positions[k];
    if (std::min({p.x, p.y, width - 1 - p.x, height - 1 - p.y}) < margin) frame.push_back(k);
  }
  const auto about_own_motion = [&](const std::vector<int>& used) {
    const double rms = rms_about(positions, displacements, used,
                                 fitted_motion(positions, displacements, used, result.drift.centre, scale, kind));
    return std::sqrt(std::max(0.0, rms * rms - noise * noise));
  };
  const double everywhere = about_own_motion(all);
  result.is_at_rest = !frame.empty() && about_own_motion(frame) < kQuieter * everywhere;
  const std::vector<int>& far = result.is_at_rest ? frame : all;
  const auto typical = [&](Drift what) {
    return typical_motion(positions, displacements, far, result.drift.centre, scale, what);
  };
  const Typical shifted = typical(Drift::translation), turned = typical(Drift::rotation);
  result.turn_rad = turned.motion.turn_rad;
  result.is_turned = turned.misfit < 0.5 * shifted.misfit && std::abs(result.turn_rad) * scale > 1;
  if (!result.is_at_rest) {
    result.drift = fitted_motion(positions, displacements, all, result.drift.centre, scale, kind);
    result.rms = result.noise = everywhere;
    result.n_beads = static_cast<int>(all.size());
    return result;
  }
  const std::size_t stride = 1 + frame.size() / kMostBeads;
  std::vector<int> used;
  for (std::size_t k = 0; k < frame.size(); k += stride) used.push_back(frame[k]);
  result.n_beads = static_cast<int>(used.size());
  const double softening = kSoftening * std::min(width - 2 * margin, height - 2 * margin) / kSide;
  fit_frame(result, positions, displacements, used, sources(width, height, margin), softening, scale, kind);
  return result;
}

}  // namespace mbtfm::segment
