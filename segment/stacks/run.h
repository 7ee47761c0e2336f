/// What mbtfm-track does with stacks: reads them, follows their beads, writes the files, reports and tells what they
/// show beside the displacement.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/findings.h"
#include "pipeline/stage/stage.h"
#include "segment/beads/track.h"
#include "segment/stacks/track.h"

namespace mbtfm::stacks {

/// Of the good beads.
struct FieldFigures {
  std::int64_t n_moving = 0, n_surely_moving = 0;  ///< by more than three and six standard errors
  double largest_um = 0;
  double sigma_um = 0, sigma_z_um = 0;  ///< medians
};
FieldFigures figures_of(const std::vector<BeadInSpace>& field);

/// Beads with this flag.
std::int64_t count(const Followed& followed, TrackFlag flag);
/// Of the beads that lie far enough from the rim to be met with again.
double share_followed(const Followed& followed);
/// Root mean square of a component of the slices' drift.
double rms_drift_um(const CommonMotion& motion);

/// Of the stressed beads' pictures over the relaxed ones'.
struct WidthRatio {
  double across = 1, along = 1;
  double larger() const;  ///< whichever stack has the wider ones
};
WidthRatio width_ratio(const Detection& relaxed, const Detection& stressed);

/// @param saturated  share of a stack's voxels
std::vector<Finding> findings_of(const Followed& followed, const WidthRatio& widths, double saturated);

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
