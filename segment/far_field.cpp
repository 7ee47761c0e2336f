#include "segment/far_field.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <opencv2/core.hpp>
#include <optional>
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

/// The two rows of a bead: its shift, each source's force less the first source's (so that they balance), turn and
/// growth.
void fill_rows(cv::Mat& rows, Vec2 place, const cv::Matx<double, 2, 4>& global, const std::vector<Vec2>& at,
               double softening) {
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
    const int column = 2 * static_cast<int>(k);
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) rows.at<double>(a, column + b) = kernel(a, b) - first(a, b);
    }
  }
  const int after_forces = 2 * static_cast<int>(at.size());
  for (int a = 0; a < 2; ++a) {
    for (int b = 0; b < 2; ++b) rows.at<double>(a, b) = global(a, b);
    for (int b = after_forces; b < rows.cols; ++b) rows.at<double>(a, b) = global(a, 2 + b - after_forces);
  }
}

/// The frame's least squares, solved for shift and forces alone; what turn and growth add is told from that by the
/// Schur complement S = C − Bᵀ A⁻¹ B of the normal matrix [A B; Bᵀ C]: asking after them costs a column each.
struct FrameFit {
  cv::Mat design, u;
  cv::Mat still;     ///< A⁻¹ r: shift and forces where nothing turns or grows
  cv::Mat response;  ///< A⁻¹ B: what they lose to a unit of turn, of growth
  cv::Mat schur;     ///< S
  cv::Mat right;     ///< r of turn and growth less Bᵀ A⁻¹ r
};

FrameFit fit_frame(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements,
                   const std::vector<int>& used, const std::vector<Vec2>& at, double softening, Vec2 centre,
                   double scale, Drift kind) {
  FrameFit fit;
  const int n = 2 * static_cast<int>(at.size()), n_all = n + n_of(kind) - 2;
  const int n_rows = 2 * static_cast<int>(used.size());
  fit.design = cv::Mat::zeros(n_rows, n_all, CV_64F);
  fit.u = cv::Mat(n_rows, 1, CV_64F);
  for (int k = 0; k < n_rows / 2; ++k) {
    cv::Mat rows = fit.design.rowRange(2 * k, 2 * k + 2);
    const Vec2 place = positions[used[k]];
    fill_rows(rows, place, global_columns(place, centre, scale), at, softening);
    fit.u.at<double>(2 * k) = displacements[used[k]].x;
    fit.u.at<double>(2 * k + 1) = displacements[used[k]].y;
  }
  cv::Mat normal, both, solved;
  cv::mulTransposed(fit.design, normal, true);
  const cv::Range shift_and_forces(0, n), turn_and_growth(n, n_all);
  const cv::Mat right = fit.design.t() * fit.u, beside = normal(shift_and_forces, turn_and_growth);
  cv::Mat alone = normal(shift_and_forces, shift_and_forces);
  const double ridge = kRidge * cv::trace(alone)[0] / n;
  for (int k = 2; k < n; ++k) alone.at<double>(k, k) += ridge;
  both = right.rowRange(shift_and_forces);
  if (n_all > n) cv::hconcat(both, beside, both);
  cv::solve(alone, both, solved, cv::DECOMP_CHOLESKY);
  fit.still = solved.col(0).clone();
  if (n_all == n) return fit;
  fit.response = solved.colRange(1, solved.cols);
  fit.schur = normal(turn_and_growth, turn_and_growth) - beside.t() * fit.response;
  fit.right = right.rowRange(turn_and_growth) - beside.t() * fit.still;
  return fit;
}

/// What the drift and the forces inside the frame leave of the beads' motion. @param kind  at most that of the fit
void take_drift(FarField& result, const FrameFit& fit, double scale, Drift kind) {
  const int n = fit.still.rows, n_asked = n_of(kind) - 2;
  cv::Mat solution = cv::Mat::zeros(fit.design.cols, 1, CV_64F), inverse;
  cv::Mat shift_and_forces = solution.rowRange(0, n), asked = solution.rowRange(n, n + n_asked);
  fit.still.copyTo(shift_and_forces);
  if (n_asked > 0) {
    const cv::Range some(0, n_asked);
    inverse = cv::Mat(fit.schur(some, some)).inv(cv::DECOMP_CHOLESKY);
    asked = inverse * fit.right.rowRange(some);
    shift_and_forces -= fit.response.colRange(some) * asked;
  }
  const cv::Mat rest = fit.u - fit.design * solution;
  const auto global = [&](int k) { return k < n_asked ? asked.at<double>(k) / scale : 0.0; };
  result.drift = {{solution.at<double>(0), solution.at<double>(1)}, global(0), global(1), result.drift.centre};
  result.rms = cv::norm(rest) / std::sqrt(rest.rows);
  if (n_asked > 0) result.turn_sigma_rad = result.rms * std::sqrt(inverse.at<double>(0, 0)) / scale;
  std::vector<double> sizes;
  for (int k = 0; k < rest.rows; ++k) sizes.push_back(std::abs(rest.at<double>(k)));
  result.noise = quantile(std::move(sizes), 0.5) / 0.6745;
}

struct WholeTurn {
  double turn_rad = 0;
  bool is_turned = false;
};

/// @param scale  half the picture, px
WholeTurn whole_turn(const std::vector<Vec2>& positions, const std::vector<Vec2>& u, const std::vector<int>& far,
                     Vec2 centre, double scale) {
  const Typical shifted = typical_motion(positions, u, far, centre, scale, Drift::translation);
  const Typical turned = typical_motion(positions, u, far, centre, scale, Drift::rotation);
  const double turn_rad = turned.motion.turn_rad;
  return {turn_rad, turned.misfit < 0.5 * shifted.misfit && std::abs(turn_rad) * scale > 1};
}

}  // namespace

std::vector<FarField> far_fields(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements,
                                 double width, double height, double margin, const std::vector<Drift>& kinds,
                                 double noise) {
  const double scale = 0.5 * std::min(width, height);
  const Vec2 centre{0.5 * (width - 1), 0.5 * (height - 1)};
  std::vector<FarField> results(kinds.size(), FarField{.drift = {.shift = {}, .centre = centre}});
  if (positions.empty()) return results;
  std::vector<int> all(positions.size()), frame, used;
  std::iota(all.begin(), all.end(), 0);
  for (const int k : all) {
    const Vec2 p = positions[k];
    if (std::min({p.x, p.y, width - 1 - p.x, height - 1 - p.y}) < margin) frame.push_back(k);
  }
  const std::size_t stride = 1 + frame.size() / kMostBeads;
  for (std::size_t k = 0; k < frame.size(); k += stride) used.push_back(frame[k]);
  std::optional<FrameFit> fit;  // made once, for all kinds
  std::optional<WholeTurn> turn_of_all, turn_of_frame;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    FarField& result = results[i];
    const auto about_own_motion = [&](const std::vector<int>& some) {
      return rms_about(positions, displacements, some,
                       fitted_motion(positions, displacements, some, centre, scale, kinds[i]));
    };
    const auto beyond_noise = [&](double rms) { return std::sqrt(std::max(0.0, rms * rms - noise * noise)); };
    const double everywhere = about_own_motion(all);
    result.is_at_rest = !frame.empty() && beyond_noise(about_own_motion(frame)) < kQuieter * beyond_noise(everywhere);
    std::optional<WholeTurn>& turn = result.is_at_rest ? turn_of_frame : turn_of_all;
    if (!turn) turn = whole_turn(positions, displacements, result.is_at_rest ? frame : all, centre, scale);
    result.turn_rad = turn->turn_rad;
    result.is_turned = turn->is_turned;
    if (!result.is_at_rest) {
      result.drift = fitted_motion(positions, displacements, all, centre, scale, kinds[i]);
      result.rms = result.noise = everywhere;
      result.n_beads = static_cast<int>(all.size());
      continue;
    }
    result.n_beads = static_cast<int>(used.size());
    if (!fit) {
      const double softening = kSoftening * std::min(width - 2 * margin, height - 2 * margin) / kSide;
      fit = fit_frame(positions, displacements, used, sources(width, height, margin), softening, centre, scale,
                      *std::max_element(kinds.begin(), kinds.end()));
    }
    take_drift(result, *fit, scale, kinds[i]);
  }
  return results;
}

}  // namespace mbtfm::segment
