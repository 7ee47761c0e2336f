#include "substrate/greens/wave.h"

#include <cmath>

#include "substrate/material.h"

namespace mbtfm::greens {

WaveCompliance wave_compliance(const Gel& gel, GelModel model, double k) {
  const double nu = gel.poisson_ratio;
  const double scale = 1 / (substrate::shear_modulus_kPa(gel) * k);
  if (model == GelModel::half_space) return {(1 - nu) * scale, scale};
  const double x = k * gel.thickness_um;
  const double kappa = 3 - 4 * nu;
  const double decay = std::exp(-2 * x);  // (8) over exp(2x): a thick layer does not overflow
  const double along = (-kappa * std::expm1(-4 * x) + 4 * x * decay) /
                       (kappa * (1 + decay * decay) + (1 + kappa * kappa + 4 * x * x) * decay);
  return {(1 - nu) * along * scale, std::tanh(x) * scale};
}

}  // namespace mbtfm::greens
