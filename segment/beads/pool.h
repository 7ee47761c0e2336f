/// Inside of the bead tracker: what a bead's neighbours add to its own measurement.
#pragma once

#include "segment/beads/scene.h"

namespace mbtfm::beads {

struct Pooled {
  Vec2 u;               ///< px
  double sigma_px = 0;  ///< standard error of a component
};

struct Pooling {
  std::vector<Pooled> beads;
  /// Standard deviation (px) of single beads beyond the errors of their registration: beads that sit loose, at other
  /// depths or on others' flanks.
  double scatter_px = 0;
};

/// Weigh each good bead's own measurement (variance s²) with what the beads around predict for it (variance T²):
///
///   u = a u_own + (1 − a) u_predicted,  1/a = 1 + s²/(T² + L²),   sigma² = a² (s² + L²) + (1 − a)² T²
///
/// L is how far single beads scatter about the field: the weight is that of the bead's own place, which is the field's
/// plus such a step, sigma the standard error of the field. The prediction is an affine motion through the beads
/// around; T² is how far such predictions miss there, beyond the measurements' own errors, from the neighbours'
/// misfits: large where the field is steep, where a bead is left to itself, small where noise is all there is. Nothing
/// is pooled beyond a standard error of 0.02 px, which is small against what a field is used for, so that beads keep
/// errors of their own.
Pooling pooled(const Scene& scene, const std::vector<Track>& tracks);

}  // namespace mbtfm::beads
