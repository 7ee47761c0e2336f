#include "substrate/greens/square.h"

#include <cmath>
#include <numbers>

#include "substrate/material.h"

namespace mbtfm::greens {

namespace {

/// x asinh(y / |x|), whose limit at x = 0 is 0
double corner_term(double x, double y) { return x == 0 ? 0 : x * std::asinh(y / std::abs(x)); }

}  // namespace

Sym2 square_compliance_um_per_kPa(const Gel& gel, double side_um, Vec2 offset_um) {
  const double nu = gel.poisson_ratio;
  const double scale = 1 / (2 * std::numbers::pi * substrate::shear_modulus_kPa(gel));
  Sym2 sum;
  for (const double sign_x : {1.0, -1.0}) {
    for (const double sign_y : {1.0, -1.0}) {
      const double x = offset_um.x + 0.5 * sign_x * side_um, y = offset_um.y + 0.5 * sign_y * side_um;
      const double over_x = corner_term(x, y), over_y = corner_term(y, x);
      sum += (scale * sign_x * sign_y) *
             Sym2{(1 - nu) * over_x + over_y, -nu * std::hypot(x, y), over_x + (1 - nu) * over_y};
    }
  }
  return sum;
}

Sym2 square_compliance_um_per_kPa(const Layer& layer, double side_um, Vec2 offset_um) {
  Sym2 sum = square_compliance_um_per_kPa(layer.gel(), side_um, offset_um);
  const double gauss = 0.5 * side_um / std::sqrt(3.0);
  for (const Vec2 p : {Vec2{gauss, gauss}, {gauss, -gauss}, {-gauss, gauss}, {-gauss, -gauss}}) {
    sum += (0.25 * side_um * side_um) * layer.point_correction_um_per_nN(offset_um - p);
  }
  return sum;
}

}  // namespace mbtfm::greens
