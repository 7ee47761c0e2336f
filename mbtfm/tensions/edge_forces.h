/// Forces along the cell's edge where no adhesion was found. Dim adhesions are missed by the dozen, each too weak for
/// the beads to show; together they hold the actin network, which pulls them inwards. So their sum alone is asked for.
#pragma once

#include <Eigen/Core>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::tensions {

struct EnsembleFit;

struct EdgeForces {
  double probability = 0;           ///< that there are any
  double sum_nN = 0, sigma_nN = 0;  ///< of their magnitudes, if there are
  double per_inward = 1;            ///< magnitudes over their parts along the inward normal, as at the adhesions
  bool are_there() const { return probability > 0.8; }  ///< the total holds them
};

/// Of even forces on free places as near to the edge as three in four of the adhesions, inwards along its normal. Their
/// sum a is expected in one cell of three, |N(0, τ²)|. τ is half the force of adhesions too small to be found: their
/// neighbours may have taken over none or all of it. With the score test's â and σ (search.h) and r = τ²/(τ² + σ²),
///
///   B = 2 √(1 − r) exp(r â²/2σ²) Φ(√r â/σ),   probability = B / (2 + B).
EdgeForces edge_forces(const EnsembleFit& fit, const Cell& cell, const Gel& gel);

/// Total and network's force with these, if they are there, and with the error by what is not known of them: whether
/// they are, and half of their sum, as the adhesions carry a part of it and forces of one place cancel. The adhesions'
/// forces are found with them; the tensions stay.
/// @param n_last  motions of the data that stay the last ones
EnsembleFit with_edge_forces(EnsembleFit fit, EdgeForces found, const Cell& cell, const Gel& gel, Eigen::Index n_last);

}  // namespace mbtfm::tensions
