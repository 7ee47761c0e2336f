#include "pipeline/numerics/quadrature.h"

#include <cmath>
#include <numbers>

namespace mbtfm::numerics {

using std::numbers::pi;

GaussRule gauss_legendre(int n) {
  GaussRule rule;
  for (int i = 0; i < n; ++i) {
    // Newton's method on P_n from its asymptotic root: quadratic, so a handful of steps reach rounding for any n here
    double x = std::cos(pi * (i + 0.75) / (n + 0.5));
    double slope = 1;
    for (int step = 0; step < 8; ++step) {
      double p = 1, previous = 0;
      for (int k = 1; k <= n; ++k) {
        const double next = ((2 * k - 1) * x * p - (k - 1) * previous) / k;
        previous = p;
        p = next;
      }
      slope = n * (x * p - previous) / (x * x - 1);
      x -= p / slope;
    }
    rule.nodes.push_back(x);
    rule.weights.push_back(2 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

}  // namespace mbtfm::numerics
