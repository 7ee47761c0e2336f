/// Inside of the bead tracker: where each bead has gone.
#pragma once

#include <optional>
#include <vector>

#include "segment/coarse_field.h"
#include "segment/local_motion.h"
#include "segment/scene.h"

namespace mbtfm::segment {

/// With the wide window chance finds one bead in twenty of unrelated pictures "again", of related ones most.
/// @throws InvalidData where it is less than one in five
void require_common_beads(int n_found, int n_beads);

/// Find the beads with the wide window: from the grid's prediction, then, where that fails, from the motion of the
/// beads already tracked around, again and again.
/// @throws InvalidData where the two images do not show the same beads
std::vector<Track> follow(const Scene& scene, const GridField& grid, const TrackParameters& parameters);

/// What the good tracks around say of each good one.
std::vector<std::optional<LocalMotion>> motions_around(const Scene& scene, const std::vector<Track>& tracks);

/// Median standard deviation (px) of single beads about those around them.
double typical_spread(const std::vector<std::optional<LocalMotion>>& around);

/// Flag tracks that contradict those around them "neighbours disagree"; how many.
int flag_outliers(const Scene& scene, double threshold, std::vector<Track>& tracks);

}  // namespace mbtfm::segment
