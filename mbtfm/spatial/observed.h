/// What beads in space tell of a gel: their displacements as rows, each with its error.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mbtfm/spatial/parameters.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/gel.h"
#include "pipeline/numerics/near.h"
#include "substrate/loads.h"

namespace mbtfm::spatial {

/// Rows: x, y, z of each bead in turn, or x and y.
struct Observed {
  substrate::Observations at;
  Eigen::VectorXd displacement_um;
  /// Standard errors; where the beads state none only their proportions are known.
  Eigen::VectorXd sigma_um;
  bool states_errors = false;
  double distance_um = 0;  ///< between neighbours

  int n_beads = 0;
  int n_flagged = 0;     ///< left out, as their flags say
  int n_above = 0;       ///< left out: further above the surface than errors bring them
  int n_below_base = 0;  ///< left out
  int n_beyond = 0;      ///< left out: beyond the rim of the surface that is known
  double depth_um = 0;   ///< below the surface, the median
  Eigen::Index n_components() const { return at.n_components(); }
};

numerics::Near near_beads(const Observed& observed);

/// @throws InvalidData where numbers are not finite, or fewer than four beads are left in the gel
Observed observe(const std::vector<BeadInSpace>& beads, const Gel& gel, const Ground& ground,
                 const SpatialParameters& parameters);

}  // namespace mbtfm::spatial
