/// Where tractions are expected.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mbtfm/spatial/parameters.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::spatial {

struct Observed;

struct SpatialInputs {
  std::vector<BeadInSpace> beads;
  Gel gel;
  std::vector<Adhesion> adhesions;  ///< may be empty
  Polygon outline_um;               ///< may be empty
};

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
