/// What the Hankel transforms and their tables share.
#pragma once

#include <cmath>
#include <numbers>

namespace mbtfm::greens {

/// Node k of the n Chebyshev nodes of the first kind on (-1, 1).
inline double chebyshev_node(int n, int k) { return std::cos(std::numbers::pi * (k + 0.5) / n); }

/// J2 = 2 J1(x)/x - J0 cancels at small x, where its series does not.
inline double bessel_2(double x, double j0, double j1) {
  return x < 1e-2 ? x * x / 8 * (1 - x * x / 12) : 2 * j1 / x - j0;
}

}  // namespace mbtfm::greens
