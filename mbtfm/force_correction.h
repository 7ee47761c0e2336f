/// Forces by adhesion of tractions on a lattice, without what the penalty takes from them. docs/theory.md (16).
#pragma once

#include <optional>

#include "mbtfm/lattice_problem.h"
#include "mbtfm/traction.h"

namespace mbtfm::inverse {

struct PenalisedTractions {
  const LatticeProblem& problem;
  const NodeField& displacements;         ///< G t
  std::optional<double> tikhonov_lambda;  ///< t is the minimum of (9) for it; unset: another penalty's
  double lambda_by_gcv = 0;               ///< of the same data, in (9)
  double variance = 0;                    ///< of one datum
};

/// A force is F = qᵀ t: the sum over its nodes of traction times area. The penalty shortens tractions, and forces with
/// them. With A = G PᵀP G and (A + m²) s = q
///
///   F + sᵀ G Pᵀ (u − P G t)
///
/// puts that right but for m² sᵀ (t − true), small in both factors (Zhang & Zhang, J. R. Stat. Soc. B 76 (2014) 217;
/// Javanmard & Montanari, J. Mach. Learn. Res. 15 (2014) 2869). Sets the standard errors by the noise, too.
/// @param owner   by node of the field: which force it belongs to, or -1
/// @param forces  the sums F
void correct_forces(const PenalisedTractions& tractions, const std::vector<int>& owner, int threads,
                    std::vector<AdhesionForce>& forces);

}  // namespace mbtfm::inverse
