/// Rules of quadrature.
#pragma once

#include <vector>

namespace mbtfm::numerics {

/// Nodes on (-1, 1) and weights of Gauss and Legendre.
struct GaussRule {
  std::vector<double> nodes, weights;
};
GaussRule gauss_legendre(int n);

}  // namespace mbtfm::numerics
