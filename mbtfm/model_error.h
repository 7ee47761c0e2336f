/// The error of the model itself. The cell's own network is one of many that its outline, adhesions and fibres allow,
/// and no mesh is it: how the adhesion forces of the same tensions differ from mesh to mesh tells how far the cell's
/// may lie from any of them. The fit takes that for an error e that each adhesion's force has beside the beads' noise
/// n,
///
///   y = C (R(t) + e) + n,   Var e = kappa V,   Var n = s²,
///
/// and so asks of the tensions what the meshes agree upon: how a load is shared among neighbours counts for little, its
/// sum for much. Generalised least squares (Aitken, Proc. R. Soc. Edinb. 55 (1936) 42).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mbtfm/linear_data.h"

namespace mbtfm::inverse {

struct ModelError {
  Eigen::VectorXd force_variance_nN2;  ///< kappa V, by component of the forces
  double kappa = 0, least_kappa = 0;   ///< as the misfit calls for; and as one further mesh would have
  double noise_variance = 0;           ///< s²: 1 where the beads' errors are as stated
  ReducedData data;             ///< C and y in coordinates in which the errors of both together have variance s²
  Eigen::VectorXd noise_share;  ///< by row of these: the part of s² that is the beads' noise
};

/// Forces that one mesh gives for the tensions common to all, and their derivatives.
struct MeshForces {
  Eigen::VectorXd forces_nN;
  Eigen::MatrixXd derivatives;
};

/// V from the meshes: one variance for both components of an adhesion's force, none between adhesions (eight meshes
/// tell no more). kappa is the size at which the meshes' mean leaves the misfit to be expected of n and e, the tensions
/// following; but not below 1 + 1/meshes, the variance of one further mesh about their mean.
/// @param meshes  at least three
/// @param beads_variance  s²; a floor of (a thousandth of what beads move on average)² is put under it
ModelError model_error(const std::vector<MeshForces>& meshes, const ReducedData& data, double beads_variance);

}  // namespace mbtfm::inverse
