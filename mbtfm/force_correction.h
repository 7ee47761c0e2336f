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

/// The penalty shortens tractions, and forces with them: sums F = qᵀ t of traction times area over some nodes. With
/// A = G PᵀP G these waves, added to t,
///
///   (A + m²)⁻¹ G Pᵀ (u − P G t)
///
/// put F right but for m² sᵀ (t − true), (A + m²) s = q, small in both factors (Zhang & Zhang, J. R. Stat. Soc. B 76
/// (2014) 217; Javanmard & Montanari, J. Mach. Learn. Res. 15 (2014) 2869). Too noisy for a map.
WaveField taken_by_penalty(const PenalisedTractions& tractions);

/// The forces so corrected, with their standard errors by the noise.
/// @param corrected_kPa  at the nodes of the field, rows first
std::vector<AdhesionForce> forces_of(const PenalisedTractions& tractions, const std::vector<Vec2>& corrected_kPa,
                                     const std::vector<Adhesion>& adhesions, double grow_um, int threads);

}  // namespace mbtfm::inverse
