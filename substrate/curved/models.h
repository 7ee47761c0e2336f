/// The model of gels whose surface is not flat.
#pragma once

#include <functional>
#include <vector>

#include "substrate/curved/space.h"
#include "substrate/models.h"

namespace mbtfm::curved {

inline constexpr substrate::Capabilities kCurvedCan{.base = true,
                                                    .sides = true,
                                                    .inside = true,
                                                    .normal_displacement = true,
                                                    .space = true,
                                                    .surface = true,
                                                    .large_strain = true};
substrate::Model curved_gel();

/// What makes the stress of a displacement.
struct StressLaw {
  /// Cauchy's (kPa), by displacement gradient and pressure.
  std::function<Eigen::Matrix3d(const Eigen::Matrix3d& gradient, double pressure_kPa)> at = {};
  std::vector<Eigen::Vector4d> pressure_kPa = {};  ///< by cell, as coefficients of its pressures
};
StressLaw linear_stress(const Space& space, const Gel& gel, const Vectors& at_nodes_um);

/// A solution inside the gel: each cell as eight, straight between the nodes.
/// @param stress  in the middle of each; empty: not asked
substrate::VolumeField volume_field(const Space& space, const Vectors& at_nodes_um, const StressLaw& stress);

}  // namespace mbtfm::curved
