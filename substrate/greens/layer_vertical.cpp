#include "substrate/greens/layer_vertical.h"

#include <math.h>  // j1: POSIX

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "pipeline/numerics/parallel.h"
#include "pipeline/numerics/quadrature.h"
#include "substrate/greens/inside.h"
#include "substrate/greens/layer.h"
#include "substrate/greens/transforms.h"
#include "substrate/material.h"

namespace mbtfm::greens {
namespace {

using std::numbers::pi;

// As in layer.cpp: over half a thickness the singularity at r = 2i is 8 half lengths away, 15^-9 = 3e-11.
constexpr int kPiecesPerUnit = 2, kNodes = 10;
constexpr int kPieces = kPiecesPerUnit * static_cast<int>(LayerTable::kReach);

}  // namespace

LayerVertical::LayerVertical(const Gel& gel) : gel_(gel), values_(kPieces * kNodes) {
  constexpr int kPanels = 48;  // of 1/2 with 20 Gauss points, as the layer's other transforms
  const numerics::GaussRule gauss = numerics::gauss_legendre(20);
  std::vector<double> at, weight;
  for (int panel = 0; panel < kPanels; ++panel) {
    for (std::size_t g = 0; g < gauss.nodes.size(); ++g) {
      at.push_back(0.5 * (panel + 0.5 * (1 + gauss.nodes[g])));
      weight.push_back(0.25 * gauss.weights[g] * base_down_by_along(gel.poisson_ratio, at.back()));
    }
  }
  for (int k = 0; k < kPieces * kNodes; ++k) {
    const double r = (k / kNodes + 0.5 * (1 + chebyshev_node(kNodes, k % kNodes))) / kPiecesPerUnit;
    for (std::size_t i = 0; i < at.size(); ++i) values_[k] += weight[i] * ::j1(at[i] * r);
    values_[k] /= r;  // smooth and even in r
  }
}

double LayerVertical::correction(double r) const {
  if (r >= LayerTable::kReach)
    return r > 0 ? -0.5 * (1 - 2 * gel_.poisson_ratio) / r : 0;  // what cancels the half-space's
  const double scaled = kPiecesPerUnit * r;
  const int piece = static_cast<int>(scaled);
  const auto weights = interpolation_weights<kNodes>(2 * (scaled - piece) - 1);
  return r * std::inner_product(weights.begin(), weights.end(), values_.begin() + piece * kNodes, 0.0);
}

std::vector<double> LayerVertical::vertical_um(const std::vector<Vec2>& points_um,
                                               const std::vector<substrate::Ellipse>& ellipses,
                                               const std::vector<Vec2>& forces_nN, int threads) const {
  std::vector<double> vertical = half_space_vertical_um(gel_, points_um, ellipses, forces_nN, threads);
  const double h = gel_.thickness_um, scale = 1 / (2 * pi * substrate::shear_modulus_kPa(gel_) * h);
  std::vector<std::vector<substrate::DiscPoint>> rules;
  for (const substrate::Ellipse& ellipse : ellipses) {  // see LayerEllipse
    const double z = 2 * h / ellipse.semi_major_um, q = 1 / (z + std::sqrt(z * z + 1));
    rules.push_back(
        substrate::ellipse_rule(ellipse, std::max(3, static_cast<int>(std::ceil(std::log(1e-8) / std::log(q))) - 1)));
  }
  numerics::parallel_for(static_cast<int>(points_um.size()), threads, [&](int i) {
    for (std::size_t j = 0; j < ellipses.size(); ++j) {
      for (const substrate::DiscPoint& p : rules[j]) {
        const Vec2 offset = points_um[i] - ellipses[j].centre_um - p.position;
        const double r = norm(offset);
        if (r > 0) vertical[i] += scale * p.weight * dot(forces_nN[j], offset) / r * correction(r / h);
      }
    }
  });
  return vertical;
}

}  // namespace mbtfm::greens
