/// The energy of one cable, its force and its stiffness, as functions of its span x_b − x_a.
///
/// Two kinks are rounded off: the one at zero length, over eps, and the one at the rest length, where the cable turns
/// stiff. There the force q of the stretch e = l − l0 is q = k max(0, e) in the end, and on the way to it the positive
/// root of q (q/k − e) = mu, the central path of interior-point methods; q = k/2 (e + sqrt(e² + 4 mu / k)).
#pragma once

#include <algorithm>
#include <cmath>

#include "pipeline/contract/geometry.h"
#include "pipeline/numerics/spring_matrix.h"

namespace mbtfm::cables {

/// Everything the force of a cable depends on.
struct Cable {
  int vertex_a = 0;
  int vertex_b = 0;
  double rest_length_um = 0;
  double tension_nN = 0;           ///< share · t of its group
  double stiffness_nN_per_um = 0;  ///< k = share · EA / l0, beyond the rest length; 0: it does not resist
};

struct Rounding {
  double eps_um = 0;  ///< l = sqrt(d² + eps²)
  double mu_fJ = 0;   ///< 0: the stretch force is k max(0, e) exactly
};

struct Pull {
  double length_um = 0;            ///< l
  double stretch_um = 0;           ///< e = l − l0, negative where the cable is shorter
  double stretch_force_nN = 0;     ///< q
  double force_nN = 0;             ///< dU/dl = t + q
  double stiffness_nN_per_um = 0;  ///< dq/dl
};

constexpr double kRestRounding = 1e-12;  // of a length, and as much again of its change by a few steps

inline double smoothed_um(double distance_um, double eps_um) {
  return std::sqrt(distance_um * distance_um + eps_um * eps_um);
}

inline Pull pull(const Cable& cable, Vec2 span_um, const Rounding& rounding) {
  const double k = cable.stiffness_nN_per_um;
  const double length = std::sqrt(dot(span_um, span_um) + rounding.eps_um * rounding.eps_um);
  // The rest length is smoothed like the length, so that the stretch begins at d = l0 exactly.
  const double e = length - smoothed_um(cable.rest_length_um, rounding.eps_um);
  if (k == 0) return {length, e, 0, cable.tension_nN, 0};
  if (rounding.mu_fJ > 0) {
    const double root = std::sqrt(e * e + 4 * rounding.mu_fJ / k);
    const double sum = e > 0 ? e + root : 4 * rounding.mu_fJ / k / (root - e);  // e + root without cancellation
    const double q = k / 2 * sum;
    return {length, e, q, cable.tension_nN + q, q / root};
  }
  // A cable at its rest length counts as stiff: a network at rest can move only by stretching.
  if (e < -kRestRounding * cable.rest_length_um) return {length, e, 0, cable.tension_nN, 0};
  const double q = k * std::max(0.0, e);
  return {length, e, q, cable.tension_nN + q, k};
}

inline double energy_fJ(const Cable& cable, const Pull& pull, const Rounding& rounding) {
  if (cable.stiffness_nN_per_um == 0) return cable.tension_nN * pull.length_um;
  const double q = pull.stretch_force_nN;
  // The integral of q over e; (log q: of the barrier, up to a constant).
  const double barrier = rounding.mu_fJ > 0 ? rounding.mu_fJ * std::log(q) : 0;
  return cable.tension_nN * pull.length_um + q * q / (2 * cable.stiffness_nN_per_um) + barrier;
}

/// d²U of one cable with respect to its span: `along_nN_per_um` along the cable and force / length across it.
/// `direction` is span / length, or an estimate of it no longer than 1.
inline numerics::SpringMatrix::Block stiffness(const Pull& pull, Vec2 span_um, double along_nN_per_um, Vec2 direction) {
  const Vec2 n = (1 / pull.length_um) * span_um;
  const double across = pull.force_nN / pull.length_um;
  const double xy = along_nN_per_um * n.x * n.y - across * (direction.x * n.y + direction.y * n.x) / 2;
  numerics::SpringMatrix::Block block;
  block << along_nN_per_um * n.x * n.x + across * (1 - direction.x * n.x), xy,  //
      xy, along_nN_per_um * n.y * n.y + across * (1 - direction.y * n.y);
  return block;
}

}  // namespace mbtfm::cables
