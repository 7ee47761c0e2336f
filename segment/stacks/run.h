/// What mbtfm-track does with stacks: reads them, follows their beads, writes the files, reports and says what they
/// show beside the displacement.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/findings.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/stage.h"
#include "segment/beads/track.h"
#include "segment/stacks/track.h"

namespace mbtfm::stacks {

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

/// Of mbtfm-track, in the plane and in space.
struct TrackStageParameters {
  beads::TrackParameters track;
  StackParameters in_space;
  images::PlaneChoice surface_plane;
  int binning = 1;  ///< to be quick: beads closer than a few pixels of the reduced images are lost
  stage::EffectSwitches effects;
};
void declare(stage::ParameterList& list, TrackStageParameters& parameters);
/// What may have moved the image, as the switches say; pixels are those of the beads.
beads::TrackParameters switched(const TrackStageParameters& given);

/// Whether the two files are stacks to be followed in space.
/// @throws UsageError where that is asked for and a slice or page was chosen
bool are_in_space(const TrackStageParameters& parameters);

/// What two stacks are good for, before they are tracked.
struct StackLook {
  int width = 0, height = 0, depth = 0;
  double pixel_um = 0, step_um = 0;
  int n_beads = 0;         ///< of the relaxed stack
  double distance_um = 0;  ///< of these, mean
};
/// @throws InputError, UsageError as run
StackLook look_at_stacks(const std::filesystem::path& relaxed, const std::filesystem::path& stressed,
                         const TrackStageParameters& parameters, int threads);

/// Inputs `relaxed`, `stressed` and, where it is given, `surface_beads`; outputs displacement_3d.csv and .vtp,
/// slices.csv, surface_beads.csv.
/// @throws InputError where the stacks do not go together, or do not say what is needed
StageReport run(const TrackStageParameters& parameters, stage::StageContext& context);

}  // namespace mbtfm::stacks
