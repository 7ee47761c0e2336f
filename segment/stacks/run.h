/// What mbtfm-track does with stacks: reads them, follows their beads, writes the files and reports.
#pragma once

#include "pipeline/stage/stage.h"
#include "segment/beads/track.h"
#include "segment/stacks/track.h"

namespace mbtfm::stacks {

/// Whether the two files are stacks to be followed in space.
/// @throws UsageError where that is asked for and a slice or page was chosen
bool are_in_space(const beads::TrackParameters& track, const StackParameters& parameters);

/// What two stacks are good for, before they are tracked.
struct StackLook {
  int width = 0, height = 0, depth = 0;
  double pixel_um = 0, step_um = 0;
  int n_beads = 0;         ///< of the relaxed stack
  double distance_um = 0;  ///< of these, mean
};
/// @throws InputError, UsageError as run
StackLook look_at_stacks(const std::filesystem::path& relaxed, const std::filesystem::path& stressed,
                         const beads::TrackParameters& track, const StackParameters& parameters, int threads);

/// Inputs `relaxed`, `stressed` and, where it is given, `surface_beads`; outputs displacement_3d.csv and .vtp,
/// slices.csv, surface_beads.csv.
/// @throws InputError where the stacks do not go together, or do not say what is needed
StageReport run(const beads::TrackParameters& track, const images::PlaneChoice& surface_plane,
                const StackParameters& parameters, stage::StageContext& context);

}  // namespace mbtfm::stacks
