/// Effects of the physics that a scene may or may not call for, and what became of each in a run.
#pragma once

#include <optional>
#include <string>

#include "pipeline/contract/words.h"

namespace mbtfm {

enum class EffectKind {
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

struct Effect {
  EffectKind kind = EffectKind::affine_drift;
  Switch setting = Switch::automatic;
  bool is_on = false;
  std::optional<double> number = {};  ///< what leaving it out would cost, where that was asked; on above the threshold
  std::optional<double> threshold = {};
  std::string why;
  double seconds = 0;                 ///< spent on it, its own question included
  std::optional<double> change = {};  ///< of the tensions were it on, relative; where that was asked (--explain)
  std::string would_change = {};      ///< the same in a sentence
};

}  // namespace mbtfm
