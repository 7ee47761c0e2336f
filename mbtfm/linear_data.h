/// The bead displacements as the fit sees them: linear in the adhesion forces, so all beads reduce to one small matrix.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "pipeline/contract/types.h"

namespace mbtfm::inverse {

/// |W (G R − u)|² = |C R − y|² + floor² for every force vector R, with C of at most as many rows as R is long.
struct LinearData {
  Eigen::MatrixXd compliance_um_per_nN;  ///< G: 2·beads × 2·adhesions, rows 2i, 2i+1 of bead i
  Eigen::VectorXd displacement_um;       ///< u, in the same order
  Eigen::VectorXd weight_per_um;         ///< W, diagonal: 1/sigma
  Eigen::MatrixXd reduced;               ///< C
  Eigen::VectorXd target;                ///< y
  double floor_squared = 0;              ///< what no force can explain
  bool has_errors = false;  ///< the beads state their sigma; without, W is 1 and the misfit tells the error
};

/// @param beads  the ones to use; all with sigma_um > 0, or weights are the same for all
/// @param compliance_um_per_nN  2·beads × 2·adhesions
LinearData reduce(const DisplacementField& beads, Eigen::MatrixXd compliance_um_per_nN);

/// |u − G R| / |u|
double relative_l2(const LinearData& data, const Eigen::VectorXd& forces_nN);

}  // namespace mbtfm::inverse
