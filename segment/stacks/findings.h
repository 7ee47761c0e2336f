/// What the beads of two stacks tell a user beside their displacement.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/findings.h"
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

}  // namespace mbtfm::stacks
