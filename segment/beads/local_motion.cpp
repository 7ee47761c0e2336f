#include "segment/beads/local_motion.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::beads {
namespace {

struct StillBead {
  Vec2 offset, u;
  double near = 1;  ///< weight by its distance
  double weight = 1;
};

double length(Vec2 v) { return std::sqrt(dot(v, v)); }  // std::hypot guards against overflow, at five times the cost

struct Fitted {
  Motion motion;
  double noise_share = 1;
};

/// Weighted least squares of u = u₀ + G d, the gradient held by a small ridge where beads lie on a line.
Fitted weighted_fit(const std::vector<StillBead>& witnesses, double reach) {
  cv::Matx33d normal;
  cv::Vec3d x, y;
  for (const StillBead& w : witnesses) {
    const cv::Vec3d row(1, w.offset.x, w.offset.y);
    for (int a = 0; a < 3; ++a) {
      const double weighted = w.weight * row[a];
      for (int b = 0; b <= a; ++b) normal(a, b) += weighted * row[b];
      x[a] += weighted * w.u.x, y[a] += weighted * w.u.y;
    }
  }
  const double total = normal(0, 0);
  double squares = 0;
  if (witnesses.size() < 6) {
    for (const StillBead& w : witnesses) squares += w.weight * w.weight;
    return {{{x[0] / total, y[0] / total}, 0, 0, 0, 0}, squares / (total * total)};
  }
  constexpr double kRidge = 0.01;  // of the weight at full reach
  normal(1, 1) += kRidge * total * reach * reach;
  normal(2, 2) += kRidge * total * reach * reach;
  for (const auto& [a, b] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) normal(a, b) = normal(b, a);
  const cv::Matx33d inverse = normal.inv(cv::DECOMP_CHOLESKY);
  const cv::Vec3d a = inverse * x, b = inverse * y;
  for (const StillBead& w : witnesses) {
    const double share = w.weight * (inverse(0, 0) + inverse(0, 1) * w.offset.x + inverse(0, 2) * w.offset.y);
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
  std::vector<StillBead> witnesses;
  witnesses.reserve(others.size());
  for (const int k : others) {
    witnesses.push_back({.offset = positions[k] - place, .u = motions[k].u});
    result.reach_px = std::max(result.reach_px, length(witnesses.back().offset));
  }
  const double per_reach = 1 / std::max(result.reach_px, 1e-9);
  for (StillBead& w : witnesses) {
    w.near = w.weight = std::exp(-2 * per_reach * per_reach * dot(w.offset, w.offset));
  }
  const double n = static_cast<double>(witnesses.size());
  std::vector<double> misfits(witnesses.size());
  for (int round = 0; round < 3; ++round) {
    const Fitted fitted = weighted_fit(witnesses, result.reach_px);
    result.motion = fitted.motion;
    result.noise_share = fitted.noise_share;
    for (std::size_t k = 0; k < misfits.size(); ++k) {
      misfits[k] = length(witnesses[k].u - result.motion.at(witnesses[k].offset));
    }
    // the median of a two-dimensional normal's length is 1.18 sd; a fit of three numbers uses up half of six beads
    result.spread_px = numerics::quantile(misfits, 0.5) / 1.18 * std::sqrt(n / std::max(1.0, n - 3));
    const double limit = 2.5 * std::max(result.spread_px, 0.02);
    for (std::size_t k = 0; k < misfits.size(); ++k) {
      const double most = std::min(1.0, limit / std::max(misfits[k], 1e-9));
      witnesses[k].weight = witnesses[k].near * most * most;
    }
  }
  return result;
}

}  // namespace mbtfm::beads
