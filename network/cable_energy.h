/// The energy of a set of cables, its slope and its stiffness, as functions of the cables' spans (x_b − x_a).
/// Spans are state of their own beside the positions: a collapsed cable is 1e-5 of an edge long and carries a force
/// that depends on its direction, which the difference of two rounded positions does not tell.
#pragma once

#include <algorithm>
#include <cmath>

#include "network/block_cholesky.h"
#include "pipeline/contract/types.h"

namespace mbtfm::network {

/// One cable in one equilibrium: everything its force depends on.
struct Cable {
  int vertex_a = 0;
  int vertex_b = 0;
  double rest_length_um = 0;
  double tension_nN = 0;           ///< share · t of its group
  double stiffness_nN_per_um = 0;  ///< share · EA / l0 beyond the rest length
};

/// A cable's scalar state at smoothing eps.
struct Pull {
  double length_um = 0;            ///< sqrt(d² + eps²)
  double force_nN = 0;             ///< dU/dl
  double stiffness_nN_per_um = 0;  ///< d²U/dl²
};

inline double smoothed_um(Vec2 span_um, double smoothing_um) {
  return std::sqrt(dot(span_um, span_um) + smoothing_um * smoothing_um);
}

/// The stretch beyond the rest length. Smoothed like the length itself, so that it begins at d = l0 exactly.
inline double stretch_um(const Cable& cable, double length_um, double smoothing_um) {
  return length_um - std::sqrt(cable.rest_length_um * cable.rest_length_um + smoothing_um * smoothing_um);
}

inline Pull pull(const Cable& cable, Vec2 span_um, double smoothing_um) {
  const double length = smoothed_um(span_um, smoothing_um);
  const double stretch = stretch_um(cable, length, smoothing_um);
  // At the rest length itself the stiff side counts: a network at rest that is to move stretches somewhere.
  if (stretch < -1e-12 * cable.rest_length_um) return {length, cable.tension_nN, 0};
  return {length, cable.tension_nN + cable.stiffness_nN_per_um * std::max(0.0, stretch), cable.stiffness_nN_per_um};
}

inline double energy_fJ(const Cable& cable, double length_um, double smoothing_um) {
  const double stretch = std::max(0.0, stretch_um(cable, length_um, smoothing_um));
  return cable.tension_nN * length_um + cable.stiffness_nN_per_um / 2 * stretch * stretch;
}

/// d²U of one cable with respect to its span: along the cable its own stiffness, across it force / length. Where the
/// cable collapses, its direction d/l changes faster than any step; `direction`, followed as an unknown of its own
/// (Chan, Golub & Mulet, SIAM J. Sci. Comput. 20 (1999) 1964), keeps Newton's method convergent for any smoothing.
inline BlockCholesky::Block stiffness(const Pull& pull, Vec2 span_um, Vec2 direction) {
  const Vec2 n = (1 / pull.length_um) * span_um;
  const double across = pull.force_nN / pull.length_um;
  const double nxx = pull.stiffness_nN_per_um * n.x * n.x - across * direction.x * n.x;
  const double nyy = pull.stiffness_nN_per_um * n.y * n.y - across * direction.y * n.y;
  const double nxy = pull.stiffness_nN_per_um * n.x * n.y - across * (direction.x * n.y + direction.y * n.x) / 2;
  BlockCholesky::Block block;
  block << across + nxx, nxy, nxy, across + nyy;
  return block;
}

}  // namespace mbtfm::network
