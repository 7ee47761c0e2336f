/// How a force along the surface of a layer on a rigid base moves the surface into it.
///
/// In Fourier space a traction along the wave vector k moves the surface by w(kh) / (mu k) into the layer, a quarter of
/// a wave ahead; in space that is
///
///   u_z(r) = (F . e) / (2 pi mu) ∫ w(kh) J1(kr) dk,   e = r/|r|
///
/// w - (1-2nu)/2, less the half-space's, falls as (kh)² exp(-2kh), so that this part is smooth. w is W_t of inside.h.
#pragma once

#include <vector>

#include "pipeline/contract/gel.h"
#include "substrate/ellipse.h"

namespace mbtfm::greens {

class LayerVertical {
 public:
  explicit LayerVertical(const Gel& gel);
  /// Displacement (um) of each point of the surface into the layer.
  std::vector<double> vertical_um(const std::vector<Vec2>& points_um, const std::vector<substrate::Ellipse>& ellipses,
                                  const std::vector<Vec2>& forces_nN, int threads) const;

 private:
  double correction(double r) const;  ///< ∫ (w(x) - (1-2nu)/2) J1(x r) dx, r in thicknesses
  Gel gel_;
  std::vector<double> values_;  ///< of the correction over r at the Chebyshev nodes of each piece
};

}  // namespace mbtfm::greens
