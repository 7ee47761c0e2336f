/// What the Hankel transforms and their tables share.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

namespace mbtfm::greens {

/// Node k of the n Chebyshev nodes of the first kind on (-1, 1).
inline double chebyshev_node(int n, int k) { return std::cos(std::numbers::pi * (k + 0.5) / n); }

/// Barycentric weights of the values at the n Chebyshev nodes of the first kind for the place t in [-1, 1].
template <int n>
std::array<double, n> interpolation_weights(double t) {
  std::array<double, n> weights{};
  double sum = 0;
  for (int k = 0; k < n; ++k) {
    const double gap = t - chebyshev_node(n, k);
    if (gap == 0) {
      weights.fill(0);
      weights[k] = 1;
      return weights;
    }
    sum += weights[k] = (k % 2 == 0 ? 1 : -1) * std::sin(pi * (k + 0.5) / n) / gap;
  }
  for (double& w : weights) w /= sum;
  return weights;
}

/// J2 = 2 J1(x)/x - J0 cancels at small x, where its series does not.
inline double bessel_2(double x, double j0, double j1) {
  return x < 1e-2 ? x * x / 8 * (1 - x * x / 12) : 2 * j1 / x - j0;
}

}  // namespace mbtfm::greens
