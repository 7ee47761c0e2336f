#include "mbtfm/sheet_stage/parameters.h"

#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::sheet_stage {

void declare(stage::ParameterList& list, Parameters& p) {
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um());
  declare(list, p.gel);
  stage::Parameter& modulus = parameter_named(list, "youngs_modulus_kPa");
  modulus.member = &p.gel_modulus_kPa;
  modulus.is_required = false;
  modulus.default_value = "";
  declare(list, p.substrate);
  declare(list, p.substrate.effects,
          {"finite_thickness", "finite_sides", "depth_graded_gel", "common_motion", "beads_under_load",
           "effect_tolerance"});
  declare(list, p.sheet);
  list.add("most_unbalanced", p.most_unbalanced, Range::between(0, 1));
  list.add("traction_sigma_kPa", p.traction_sigma_kPa, Range::between(0, 1e4));
  list.add("traction_correlation_um", p.traction_correlation_um, Range::size_um());
  list.add("fit_parts", p.fit_parts);
  list.add("field_points", p.field_points, Range::between(4, 200));
  list.add("fit_line_tension", p.fit_line_tension);
  list.add("fit_adhesion_stiffness", p.fit_adhesion_stiffness);
  list.add("outline_error_um", p.outline_error_um, Range::zero_or_size_um());
  list.add("loss", p.loss);
}

}  // namespace mbtfm::sheet_stage
