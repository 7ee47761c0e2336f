/// What all beads of a stack do together beside the cell's pull.
#pragma once

#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/contract/words.h"

namespace mbtfm::stacks {

/// A bead that was followed.
struct Moved {
  Vec3 place_um, displacement_um;
  double sigma_um = 0, sigma_z_um = 0;
};

/// u = shift + turn x (place - centre) + (slice drift at z, across): what is common to the beads at rest.
struct CommonMotion {
  Vec3 centre_um, shift_um, shift_sigma_um;
  double turn_rad = 0, turn_sigma_rad = 0;  ///< about z, from +x towards +y
  std::vector<double> z_um;                 ///< places along z, rising
  std::vector<Vec2> slices_um;              ///< drift there beyond the shift; linear between
  std::vector<double> slices_sigma_um;      ///< standard error of each component, with that of the shift
  std::vector<double> drift_sigma_um;       ///< without it
  double slice_drift_ratio = 0;             ///< square root of twice the gain in log likelihood by that drift
  bool has_slice_drift = false;             ///< it is part of the motion; otherwise only reported
  double share_at_rest = 0;                 ///< of the beads

  Vec3 at(Vec3 place_um) const;
  Vec3 drift_um_at(double z_um) const;          ///< zero where it is not part of the motion
  double drift_sigma_um_at(double z_um) const;  ///< of a component
};

/// Where the slices lie. step_um = 0: not known.
struct Slices {
  double first_um = 0, step_um = 0;
};

/// By robust least squares: beads that the cell moves do not count. Their share is not known before; the scale is that
/// of the quietest third, so that up to two thirds may move. A bead's picture is about as long as two slices, so its
/// place moves by what is linear between those of the slices; where beads are few, of every second one, and so on. How
/// much of the mean at each depth is the stage's: stage_by_depth(). On `automatic` the drift belongs to the motion
/// where the ratio is above 2.
CommonMotion common_motion(const std::vector<Moved>& beads, Switch slice_drift, const Slices& slices);

}  // namespace mbtfm::stacks
