#include "segment/local_motion.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace mbtfm::segment {
namespace {

struct Fitted {
  Motion motion;
  double noise_share = 1;
};

/// Weighted least squares of u = u₀ + G d, the gradient held by a small ridge where beads lie on a line.
Fitted weighted_fit(const std::vector<Vec2>& offsets, const std::vector<Vec2>& u, const std::vector<double>& weights,
                    double reach) {
  cv::Matx33d normal;
  cv::Vec3d x, y;
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    const cv::Vec3d row(1, offsets[k].x, offsets[k].y);
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) normal(a, b) += weights[k] * row[a] * row[b];
      x[a] += weights[k] * row[a] * u[k].x;
      y[a] += weights[k] * row[a] * u[k].y;
    }
  }
  const double total = normal(0, 0);
  double squares = 0;
  if (offsets.size() < 6) {
    for (const double weight : weights) squares += weight * weight;
    return {{{x[0] / total, y[0] / total}, 0, 0, 0, 0}, squares / (total * total)};
  }
  constexpr double kRidge = 0.01;  // of the weight at full reach
  normal(1, 1) += kRidge * total * reach * reach;
  normal(2, 2) += kRidge * total * reach * reach;
  const cv::Matx33d inverse = normal.inv(cv::DECOMP_CHOLESKY);
  const cv::Vec3d a = inverse * x, b = inverse * y;
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    const double share = weights[k] * (inverse(0, 0) + inverse(0, 1) * offsets[k].x + inverse(0, 2) * offsets[k].y);
    squares += share * share;
  }
  return {{{a[0], b[0]}, a[1], a[2], b[1], b[2]}, squares};
}

}  // namespace

std::optional<LocalMotion> local_motion(Vec2 place, const std::vector<int>& others, const std::vector<Vec2>& positions,
                                        const std::vector<Motion>& motions) {
  if (others.empty()) return std::nullopt;
  LocalMotion result;
  result.n_beads = static_cast<int>(others.size());
  std::vector<Vec2> offsets, u;
  for (const int k : others) {
    offsets.push_back(positions[k] - place);
    u.push_back(motions[k].u);
    result.reach_px = std::max(result.reach_px, norm(offsets.back()));
  }
  std::vector<double> near(others.size());
  for (std::size_t k = 0; k < near.size(); ++k) {
    const double d = norm(offsets[k]) / std::max(result.reach_px, 1e-9);
    near[k] = std::exp(-2 * d * d);
  }
  std::vector<double> weights = near;
  for (int round = 0; round < 3; ++round) {
    const Fitted fitted = weighted_fit(offsets, u, weights, result.reach_px);
    result.motion = fitted.motion;
    result.noise_share = fitted.noise_share;
    std::vector<double> misfits;
    for (std::size_t k = 0; k < u.size(); ++k) misfits.push_back(norm(u[k] - result.motion.at(offsets[k])));
    // the median of a two-dimensional normal's length is 1.18 sd; a fit of three numbers uses up half of six beads
    const double n = static_cast<double>(u.size());
    result.spread_px = quantile(misfits, 0.5) / 1.18 * std::sqrt(n / std::max(1.0, n - 3));
    const double limit = 2.5 * std::max(result.spread_px, 0.02);
    for (std::size_t k = 0; k < u.size(); ++k)
      weights[k] = near[k] * std::min(1.0, std::pow(limit / std::max(misfits[k], 1e-9), 2));
  }
  return result;
}

}  // namespace mbtfm::segment
