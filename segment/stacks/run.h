/// What mbtfm-track does with stacks: reads them, follows their beads, writes the files and reports.
#pragma once

#include "pipeline/stage/stage.h"
#include "segment/beads/track.h"
#include "segment/stacks/track.h"

namespace mbtfm::stacks {

/// Whether the two files are stacks to be followed in space.
/// @throws UsageError where that is asked for and a slice or page was chosen
bool are_in_space(const beads::TrackParameters& track, const StackParameters& parameters);

/// Inputs `relaxed`, `stressed` and, where it is given, `surface_beads`; outputs displacement_3d.csv and .vtp,
/// slices.csv, surface_beads.csv.
/// @throws InputError where the stacks do not go together, or do not say what is needed
StageReport run(const beads::TrackParameters& track, const images::PlaneChoice& surface_plane,
                const StackParameters& parameters, stage::StageContext& context);

}  // namespace mbtfm::stacks
