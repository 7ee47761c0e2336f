/// The bead displacements as the fit sees them: linear in the adhesion forces, so all beads reduce to one small matrix.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "pipeline/contract/types.h"

namespace mbtfm::inverse {

/// |W (G R − u)|² = |C R − y|² + floor² for every force vector R, with C of at most as many rows as R is long.
struct ReducedData {
  Eigen::MatrixXd compliance;     ///< C
  Eigen::VectorXd target;         ///< y
  double floor_squared = 0;       ///< what no force can explain
  Eigen::Index n_components = 0;  ///< of the beads' displacements that it stands for
};

struct LinearData {
  std::vector<Vec2> position_um;         ///< of the beads
  Eigen::MatrixXd compliance_um_per_nN;  ///< G: 2·beads × 2·adhesions, rows 2i, 2i+1 of bead i
  Eigen::VectorXd displacement_um;       ///< u, in the same order
  Eigen::VectorXd weight_per_um;         ///< W, diagonal: 1/sigma; 0 where the bead is not used
  Eigen::VectorXd bead_weight;           ///< by bead, 0 … 1: what a robust loss leaves of W²
  Eigen::Index n_used = 0;               ///< components of the beads that are used
  bool has_errors = false;  ///< the beads state their sigma; without, W is 1 and the misfit tells the error
  ReducedData reduced;      ///< of all that, bead_weight included
};

/// @param beads  all with sigma_um > 0, or weights are the same for all
/// @param compliance_um_per_nN  2·beads × 2·adhesions
/// @param is_used  by bead; empty: all
LinearData reduce(const DisplacementField& beads, Eigen::MatrixXd compliance_um_per_nN,
                  const std::vector<bool>& is_used = {});

/// Reduce again with these weights by bead.
void reweight(LinearData& data, const Eigen::VectorXd& bead_weight);

/// u − G R, times W
Eigen::VectorXd weighted_residual(const LinearData& data, const Eigen::VectorXd& forces_nN);

/// Variance of a weighted component that is the beads' alone: what even forces independent of each other leave. Not
/// below the stated errors'.
double noise_variance(const LinearData& data);

/// |u − G R| / |u| over the beads that are used
double relative_l2(const LinearData& data, const Eigen::VectorXd& forces_nN);

}  // namespace mbtfm::inverse
