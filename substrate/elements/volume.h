/// A solution inside the gel, as boxes with values.
#pragma once

#include <functional>
#include <vector>

#include "substrate/compliance.h"
#include "substrate/elements/space.h"
#include "substrate/material.h"

namespace mbtfm::elements {

/// What makes the stress of a displacement.
struct StressLaw {
  /// Cauchy's (kPa), by displacement gradient, pressure and z.
  std::function<Eigen::Matrix3d(const Eigen::Matrix3d& gradient, double pressure, double z_um)> at = {};
  std::vector<Eigen::Vector4d> pressures = {};  ///< by cell, as coefficients of its pressures
};
StressLaw linear_stress(const Space& space, const substrate::Material& material, const Vectors& at_nodes_um);

/// Where in an eighth of a cell the gradient is taken that makes its stress. Means of boxes add up to what the
/// elements' balance of forces is made of.
enum class Gradients { in_the_middle, mean };

/// Each cell as eight, straight between the nodes. @param stress  of each; empty: not asked
substrate::VolumeField volume_field(const Space& space, const Vectors& at_nodes_um, const StressLaw& stress,
                                    Gradients gradients = Gradients::in_the_middle);

}  // namespace mbtfm::elements
