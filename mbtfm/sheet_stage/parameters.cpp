#include "mbtfm/sheet_stage/parameters.h"

#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::sheet_stage {

void declare(stage::ParameterList& list, Parameters& p) {
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um(),
           "side of a pixel of an outline that is a mask or a selection (um)");
  declare(list, p.gel);
  stage::Parameter& modulus = parameter_named(list, "youngs_modulus_kPa");
  modulus.member = &p.gel_modulus_kPa;
  modulus.is_required = false;
  modulus.default_value = "";
  modulus.meaning += "; unset: springs, or nothing, carry the sheet";
  declare(list, p.substrate);
  declare(list, p.substrate.effects,
          {"finite_thickness", "finite_sides", "depth_graded_gel", "common_motion", "beads_under_load",
           "effect_tolerance"});
  parameter_named(list, "beads_under_load").meaning =
      "with --displacement: use the beads' positions under load, as the images show the outline; auto: off";
  declare(list, p.sheet);
  list.add("most_unbalanced", p.most_unbalanced, Range::between(0, 1),
           "with --traction: largest share of net force or torque that is corrected; more is an error");
  list.add("traction_sigma_kPa", p.traction_sigma_kPa, Range::between(0, 1e4),
           "with --traction: standard error of a traction component (kPa), for the tensions' errors; unset: none");
  list.add("traction_correlation_um", p.traction_correlation_um, Range::size_um(),
           "with --traction: resolution, within which neighbours share their error (um); unset: none do");
  list.add("fit_parts", p.fit_parts,
           "with --displacement: parts with their own contraction: none; edge: a band of edge_band_um and the inside; "
           "cells: each cell of --cells; field: a smooth variation, as the beads require");
  list.add("field_points", p.field_points, Range::between(4, 200),
           "with fit_parts = field: approximate number of nodes of the bilinear contraction");
  list.add("fit_line_tension", p.fit_line_tension, "with --displacement: also fit line_tension_nN");
  list.add("fit_adhesion_stiffness", p.fit_adhesion_stiffness,
           "with --displacement: also fit adhesion_stiffness_nN_per_um3");
  list.add("outline_error_um", p.outline_error_um, Range::zero_or_size_um(),
           "with --displacement: standard error of the outline's position (um), part of the intervals; unset: 0.05 if "
           "segmented or from a table, a pixel of a mask, 0.5 if drawn");
  list.add("loss", p.loss, "with --displacement: loss function of the residuals; all but squares downweight outliers");
}

}  // namespace mbtfm::sheet_stage
