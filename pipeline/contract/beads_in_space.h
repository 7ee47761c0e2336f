/// Where the gel went, of beads in its volume.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// Displacement (stressed minus relaxed position) of one bead; z into the gel.
struct BeadInSpace {
  Vec3 position_um;  ///< in the relaxed state; the flat surface at z = 0
  Vec3 displacement_um;
  double sigma_um = 0;    ///< standard error along x and along y
  double sigma_z_um = 0;  ///< along z, where microscopes see worse
  std::string flag;       ///< why it must not be used; empty: good
};

/// @throws InvalidData where a number is not finite or a standard error below 0
void check(const std::vector<BeadInSpace>& beads);

}  // namespace mbtfm
