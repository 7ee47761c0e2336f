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

/// 1, x, y, and in a curved motion x², xy, y².
template <int N>
cv::Vec<double, N> row_at(Vec2 d) {
  if constexpr (N == 1) return {1};
  if constexpr (N == 3) return {1, d.x, d.y};
  if constexpr (N == 6) return {1, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y};
}

/// Coefficients of the rows, and what they are at the middle of the variance of one bead.
template <int N>
struct Fitted {
  cv::Vec<double, N> x, y;
  double noise_share = 1;
  Vec2 at(Vec2 d) const { return {row_at<N>(d).dot(x), row_at<N>(d).dot(y)}; }
  Motion motion() const {
    if constexpr (N == 1) return {.u = {x[0], y[0]}};
    if constexpr (N > 1) return {{x[0], y[0]}, x[1], x[2], y[1], y[2]};
  }
};

/// Weighted least squares, the derivatives held by a small ridge where beads lie on a line.
template <int N>
Fitted<N> weighted_fit(const std::vector<StillBead>& witnesses, double reach) {
  cv::Matx<double, N, N> normal;
  cv::Vec<double, N> x, y;
  for (const StillBead& w : witnesses) {
    const cv::Vec<double, N> row = row_at<N>(w.offset);
    for (int a = 0; a < N; ++a) {
      const double weighted = w.weight * row[a];
      for (int b = 0; b <= a; ++b) normal(a, b) += weighted * row[b];
      x[a] += weighted * w.u.x, y[a] += weighted * w.u.y;
    }
  }
  const double total = normal(0, 0);
  constexpr double kRidge = 0.01;  // of the weight at full reach
  for (int a = 0; a < N; ++a) {
    if (a > 0) normal(a, a) += kRidge * total * std::pow(reach, a < 3 ? 2 : 4);
    for (int b = 0; b < a; ++b) normal(b, a) = normal(a, b);
  }
  const cv::Matx<double, N, N> inverse = normal.inv(cv::DECOMP_CHOLESKY);
  Fitted<N> fitted{inverse * x, inverse * y, 0};
  for (const StillBead& w : witnesses) {
    const cv::Vec<double, N> row = row_at<N>(w.offset);
    double share = 0;
    for (int a = 0; a < N; ++a) share += inverse(0, a) * row[a];
    fitted.noise_share += std::pow(w.weight * share, 2);
  }
  return fitted;
}

/// Three rounds, outliers weighing less from the second on.
template <int N>
void fit(std::vector<StillBead>& witnesses, LocalMotion& result) {
  const double n = static_cast<double>(witnesses.size());
  std::vector<double> misfits(witnesses.size());
  for (int round = 0; round < 3; ++round) {
    const Fitted<N> fitted = weighted_fit<N>(witnesses, result.reach_px);
    result.motion = fitted.motion();
    result.noise_share = fitted.noise_share;
    for (std::size_t k = 0; k < misfits.size(); ++k) {
      misfits[k] = length(witnesses[k].u - fitted.at(witnesses[k].offset));
    }
    // the median of a two-dimensional normal's length is 1.18 sd; a fit of three numbers uses up half of six beads
    result.spread_px = numerics::quantile(misfits, 0.5) / 1.18 * std::sqrt(n / std::max(1.0, n - std::max(3, N)));
    const double limit = 2.5 * std::max(result.spread_px, 0.02);
    for (std::size_t k = 0; k < misfits.size(); ++k) {
      const double most = std::min(1.0, limit / std::max(misfits[k], 1e-9));
      witnesses[k].weight = witnesses[k].near * most * most;
    }
  }
}

}  // namespace

std::optional<LocalMotion> local_motion(Vec2 place, const std::vector<int>& others, const std::vector<Vec2>& positions,
                                        const std::vector<Motion>& motions, Order order) {
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
  if (others.size() < 6) {
    fit<1>(witnesses, result);
  } else if (order == Order::affine || others.size() < 12) {
    fit<3>(witnesses, result);
  } else {
    fit<6>(witnesses, result);
  }
  return result;
}

}  // namespace mbtfm::beads
