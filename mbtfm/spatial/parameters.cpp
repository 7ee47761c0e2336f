#include "mbtfm/spatial/parameters.h"

#include "pipeline/stage/parameters.h"

namespace mbtfm::spatial {

void declare(stage::ParameterList& list, SpatialParameters& p) {
  list.table("traction");
  list.add("spacing_beads", p.spacing_beads, Range::between(0.2, 5),
           "beads in space: spacing of the lattice of tractions over the mean distance of the beads, if spacing_um is "
           "unset; more: fewer tractions, in less time");
  list.add("region", p.region,
           "beads in space: where the cell pulls; auto: in the outline grown by two distances of beads, or everywhere "
           "if there is no outline");
  list.add("refine", p.refine,
           "beads in space: faces of tractions are all alike (none), or a quarter as wide in the region as outside "
           "(region), or begin twice as wide and are split once where the beads resolve more and tractions exceed "
           "their errors (resolved), or the two fifths with the largest tractions (threshold)");
  list.add("background", p.background, Range::between(0, 1),
           "beads in space: traction expected outside of the region, over the traction within it; 0: none");
  list.add("loss", p.loss,
           "beads in space: loss function of a bead's misfit; all but l2 tolerate beads that are wrong");
  list.add("axial_sigma_ratio", p.axial_sigma_ratio, Range::between(0.1, 100),
           "beads in space: error along z over the error along x and y, if displacement_3d.csv has no sigma_z_um");
  list.add("with_axial", p.with_axial, "beads in space: also use the displacement along z");
}

}  // namespace mbtfm::spatial
