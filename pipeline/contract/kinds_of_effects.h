/// The list of the kinds of effects, for sources that name one.
#pragma once

#include <array>

#include "pipeline/contract/effects.h"

namespace mbtfm {

enum class EffectKind : int {
  // the bead images
  affine_drift,
  correlation_windows,
  // the gel
  finite_thickness,
  finite_sides,
  depth_graded_gel,
  vertical_displacement,
  uneven_surface,
  large_strain,
  // the network
  stress_fibres,
  cable_elasticity,
  // the fit
  common_motion,
  beads_under_load,
  channel_shift,
  beyond_cut,
  robust_loss,
  time_coupling,
  // sheets
  gel_response,
  adhesion_slip,
  edge_tension,
  third_dimension
};
/// For people, and in records.
constexpr auto words(EffectKind) {
  return std::array{"affine drift",     "correlation windows",   "finite thickness", "finite sides",
                    "depth-graded gel", "vertical displacement", "uneven surface",   "large strain",
                    "stress fibres",    "elasticity of cables",  "common motion",    "beads under load",
                    "channel shift",    "forces beyond the cut", "robust loss",      "time coupling",
                    "gel's response",   "adhesion slip",         "edge tension",     "third dimension"};
}

}  // namespace mbtfm
