/// Two pictures of a place where no cell pulls: what the microscope and the tracker make of beads that stay where they
/// are.
#pragma once

#include "segment/beads/track.h"

namespace mbtfm::beads {

struct UnloadedPlace {
  double noise_um = 0;       ///< of a displacement component, robust standard deviation, less the drift
  double noise_error = 0;    ///< of that, relative standard error
  double stated_um = 0;      ///< the same as the tracker states it: root mean square of sigma_um
  double beads_per_um2 = 0;  ///< that were followed
  double found_per_um2 = 0;  ///< in the first picture
  double share_lost = 0;     ///< of those found
  Vec2 drift_um;             ///< of the second picture
  double shared_um = 0;      ///< what whole regions of the picture do alike beside the drift, root mean square
};

/// @param width_um, height_um  of the pictures
/// @throws InvalidData for fewer than 10 beads
UnloadedPlace unloaded_place(const Tracking& tracking, double width_um, double height_um);

/// Whether whole regions move, as they do where a cell pulls, a dish is turned or a gel swells: by more than a third of
/// the noise of a bead, which beads that err independently of each other cannot.
bool is_moving(const UnloadedPlace& place);

}  // namespace mbtfm::beads
