/// Forces by adhesion beside the tractions of a lattice. docs/theory/reconstructions.md (16).
#pragma once

#include <Eigen/Core>

#include "mbtfm/tractions/lattice_problem.h"
#include "mbtfm/tractions/regularisation.h"
#include "pipeline/contract/results.h"

namespace mbtfm::tractions {

/// What `forces_on` knows of the data.
struct ForceData {
  const LatticeProblem& problem;
  const LambdaScan& scan;             ///< of the same problem
  const Eigen::MatrixXd& compliance;  ///< D: displacements (um) by forces of one (nN) spread evenly over the ellipses
};

/// The beads' displacements (times the roots of their weights) come from forces F on the adhesions, from tractions
/// without a pattern everywhere, and from noise:
///
///   u = D F + P G t + noise,   noise ~ sigma²,   t ~ sigma² / m²,   F ~ s²
///
/// the first two variances being those that make (9) with lambda = m the best guess of t. With
/// W = D − P G (A + m²)⁻¹ G Pᵀ D, A = G PᵀP G, what is known of F has the covariance and the mean
///
///   C = (Wᵀ D / sigma² + 1 / s²)⁻¹,   F = C Wᵀ u / sigma²
///
/// (Lindley & Smith, J. R. Stat. Soc. B 34 (1972) 1). m and s are the most likely ones for u: where forces on the
/// adhesions explain all, there is no background, and where the adhesions do not explain the beads, it is strong.
/// @param forces  of the map, by adhesion: their moments stay
std::vector<AdhesionForce> forces_on(const ForceData& data, std::vector<AdhesionForce> forces, int threads);

}  // namespace mbtfm::tractions
