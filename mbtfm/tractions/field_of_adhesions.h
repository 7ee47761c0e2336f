/// What adhesions that pull make of all beads, as far as some of the beads show it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/cell.h"
#include "substrate/ellipse.h"

namespace mbtfm::tractions {

/// Displacements of all beads by a force on each adhesion and a common affine motion, which explain those without a
/// flag best: Tukey's loss, so that outliers do not count. To guess by, near adhesions: the gel is taken
/// for a thick, incompressible layer.
class FieldOfAdhesions {
 public:
  FieldOfAdhesions(const std::vector<Adhesion>& adhesions, int threads);
  /// um, of all beads. Empty where there are not ten data for each unknown: a bead would determine much of its own
  /// guess. Quicker for the places of the last call; of displacements that are mostly those of the last call, what was
  /// found then shows which beads are outliers.
  std::vector<Vec2> um(const DisplacementField& beads);

 private:
  std::vector<substrate::Ellipse> ellipses_;
  int threads_;
  std::vector<Vec2> places_um_;                 ///< of the last call
  Eigen::MatrixXd shapes_;                      ///< there, 2·beads × unknowns: by forces of 1 nN, and six motions
  Eigen::VectorXd displacement_um_, field_um_;  ///< of the last call, as measured and as found: 2·beads
};

}  // namespace mbtfm::tractions
