#include "mbtfm/spatial/parameters.h"

namespace mbtfm::spatial {

void declare(stage::ParameterList& list, SpatialParameters& p) {
  list.table("traction");
  list.add("region", p.region,
           "beads in space: where the cell pulls; auto: the outline, grown by two distances of beads, else all");
  list.add("background", p.background, Range::between(0, 1),
           "beads in space: traction expected outside of the region, over the one within; 0: none");
  list.add("loss", p.loss, "beads in space: what the misfit of a bead costs; all but l2 tolerate beads that are wrong");
  list.add("axial_sigma_ratio", p.axial_sigma_ratio, Range::between(0.1, 100),
           "beads in space: error along z over the one along x and y, if displacement_3d.csv has no sigma_z_um");
  list.add("with_axial", p.with_axial, "beads in space: displacement along z counts, too");
}

}  // namespace mbtfm::spatial
