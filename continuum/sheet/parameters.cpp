#include "continuum/sheet/parameters.h"

#include "pipeline/contract/errors.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::sheet {

void declare(stage::ParameterList& list, SheetParameters& p) {
  list.table("sheet");
  list.add("youngs_modulus_kPa", p.youngs_modulus_kPa, Range::modulus_kPa(), "Young's modulus of the cells (kPa)");
  list.add("poisson_ratio", p.poisson_ratio, Range::between(0, 0.5), "Poisson's ratio of the cells, in plane stress");
  list.add("thickness_um", p.thickness_um, Range::size_um(), "thickness of the cells (um)");
  list.add("contraction_nN_per_um", p.contraction_nN_per_um, Range::between(0, 1e4),
           "contraction of the sheet as a tension (nN/um, or mN/m)");
  list.add("contraction_kPa", p.contraction_kPa, Range::between(0, 1e4),
           "contraction as a stress (kPa), times thickness_um; give one of the two");
  list.add("edge_band_um", p.edge_band_um, Range::size_um(),
           "the sheet contracts only within this distance of its edge (um); unset: all of it");
  list.add("line_tension_nN", p.line_tension_nN, Range::between(0, 1e4), "tension of a cable along the edge (nN)");
  list.add("adhesion_stiffness_nN_per_um3", p.adhesion_stiffness_nN_per_um3, Range::between(1e-9, 1e9),
           "stiffness of adhesions, or of springs in place of the ground, by area (nN/um3 = kPa/um); unset: bonded to "
           "the gel");
  list.add("ground", p.ground,
           "what carries the sheet; auto: the gel, or springs if none is given or it is much stiffer than the "
           "adhesions; none: the tractions are given");
  list.add("strain", p.strain,
           "size of the sheet's strains; auto: large on springs if the contraction is large, small on a gel");
  list.add("contraction_measure", p.contraction_measure,
           "large strain: contraction as a tension of the deformed surface (surface-tension), or of the material "
           "(second-piola)");
  list.add("mesh_um", p.mesh_um, Range::mesh_um(),
           "side of the mesh's triangles at the edge (um); unset: by the sheet's size");
}

Material material_of(const SheetParameters& p) {
  if (!p.youngs_modulus_kPa)
    throw UsageError("[sheet] youngs_modulus_kPa is missing: give it in cell.toml, or fit it by --displacement");
  if (!p.thickness_um) throw UsageError("[sheet] thickness_um is missing: give it in cell.toml");
  return {*p.youngs_modulus_kPa, p.poisson_ratio, *p.thickness_um};
}

double contraction_of(const SheetParameters& p) {
  if (p.contraction_nN_per_um && p.contraction_kPa)
    throw UsageError("[sheet] contraction_nN_per_um and contraction_kPa are both given");
  if (p.contraction_nN_per_um) return *p.contraction_nN_per_um;
  if (!p.contraction_kPa)
    throw UsageError(
        "[sheet] contraction_nN_per_um (or contraction_kPa) is missing: give it, or fit it by --displacement");
  if (!p.thickness_um) throw UsageError("[sheet] thickness_um is missing: contraction_kPa needs it");
  return *p.contraction_kPa * *p.thickness_um;
}

}  // namespace mbtfm::sheet
