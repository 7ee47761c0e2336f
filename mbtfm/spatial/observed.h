/// What beads in space show of a gel, their displacements as rows, each with its error; and where tractions are
/// expected.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "mbtfm/spatial/parameters.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "pipeline/numerics/near.h"
#include "substrate/loads.h"

namespace mbtfm::spatial {

struct SpatialInputs {
  std::vector<BeadInSpace> beads;
  Gel gel;
  std::vector<Adhesion> adhesions;  ///< may be empty
  Polygon outline_um;               ///< may be empty
};

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

struct Expected {
  Rectangle over;                     ///< in which tractions are looked for
  std::function<bool(Vec2)> is_part;  ///< of the region
  std::string where;                  ///< for people
  double background = 0;              ///< amplitude outside of the region, of 1 within
  double amplitude(Vec2 at_um) const { return is_part(at_um) ? 1 : background; }
};

/// @throws UsageError where the region asked for is not given; InvalidData where it covers no place above the beads
Expected expected_tractions(const SpatialInputs& inputs, const Observed& observed, const Ground& ground,
                            const SpatialParameters& parameters, double grow_um);

/// Weights of the tractions at the vertices whose sum is the force on each adhesion: adhesions × vertices (um²).
Eigen::MatrixXd adhesion_areas_um2(const TractionMesh& mesh, const Ground& ground,
                                   const std::vector<Adhesion>& adhesions, double grow_um);

}  // namespace mbtfm::spatial
