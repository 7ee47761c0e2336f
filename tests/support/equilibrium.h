/// What holds of every equilibrium of cables.
#pragma once

#include "network/cables/cables.h"
#include "tests/support/test.h"

namespace mbtfm::test {

inline Vec2 net_force_nN(const std::vector<Vec2>& forces_nN) {
  Vec2 sum;
  for (const Vec2 force : forces_nN) sum += force;
  return sum;
}

/// About the origin, of forces at positions.
inline double net_torque(const std::vector<Vec2>& positions_um, const std::vector<Vec2>& forces_nN) {
  double sum = 0;
  for (std::size_t v = 0; v < forces_nN.size(); ++v) sum += cross(positions_um[v], forces_nN[v]);
  return sum;
}

inline double largest(const std::vector<Vec2>& values) {
  double result = 0;
  for (const Vec2 value : values) result = std::max(result, norm(value));
  return result;
}

/// Converged, and what holds the network feels no net force and no net torque. What is left of either is the sum of
/// the free vertices' net forces, each below `report.last_change`, and the rounding of the sums.
inline void expect_equilibrium(const cables::CableNetwork& cables, const std::vector<double>& tensions_nN,
                               const cables::Equilibrium& equilibrium) {
  EXPECT_TRUE(equilibrium.report.converged) << equilibrium.report.reason;
  const std::vector<Vec2> reactions = cables.reactions_nN(tensions_nN, equilibrium);
  const double n = static_cast<double>(reactions.size());
  const double force = n * (equilibrium.report.last_change + 1e-15 * largest(reactions));
  EXPECT_LE(norm(net_force_nN(reactions)), force);
  EXPECT_LE(std::abs(net_torque(equilibrium.positions_um, reactions)), force * largest(equilibrium.positions_um));
}

}  // namespace mbtfm::test
