/// Inside of the bead tracker: where each bead has gone.
#pragma once

#include <optional>
#include <vector>

#include "segment/beads/coarse_field.h"
#include "segment/beads/local_motion.h"
#include "segment/beads/scene.h"

namespace mbtfm::beads {

struct Followed {
  std::vector<Track> tracks;
  int n_by_grid = 0;      ///< found from the grid's prediction, and not contradicted by their neighbours
  double period_px = 0;   ///< of a pattern that repeats itself; 0: it does not
  bool has_gaps = false;  ///< parts of the picture have no beads that are found so
};

/// Find the beads with the wide window: from the grid's prediction, then, where that fails, from the motion of the
/// beads already tracked around, again and again.
Followed follow(const Scene& scene, const GridField& grid, const TrackParameters& parameters);

/// Of unrelated pictures the wide window finds one bead in twenty "again", by chance, and all that comes after finds up
/// to two in five; of related ones each finds most. Of beads that scatter by more than their width, but by less than
/// a quarter of their distance, the window finds few and what comes after three in four.
/// @throws NotFollowed where fewer than two in three are found in the end, and fewer than one in five there or by the
/// grid
void require_common_beads(int n_by_grid, int n_in_the_end, int n_beads);

/// What the good tracks around say of each good one.
/// @param expected  by bead, px: beads are compared in what they do beside it; empty: nothing is
std::vector<std::optional<LocalMotion>> motions_around(const Scene& scene, const std::vector<Track>& tracks,
                                                       const std::vector<Vec2>& expected = {});

/// Median standard deviation (px) of single beads about those around them.
double typical_spread(const std::vector<std::optional<LocalMotion>>& around);

/// Flag tracks that contradict those around them "neighbours disagree"; how many.
int flag_outliers(const Scene& scene, double threshold, std::vector<Track>& tracks);

/// By bead, px: how far those around it miss its expected motion, which are compared in all that they do; 0 without
/// a good track.
/// @param beside  motions_around() with what is expected
std::vector<double> missed_around(const Scene& scene, const std::vector<Track>& tracks,
                                  const std::vector<std::optional<LocalMotion>>& beside);

/// The same of what beads do beside their expected motions (px), of which half of what the beads around do not tell
/// may be wrong.
int flag_outliers_beside(const std::vector<Vec2>& expected, const Scene& scene, double threshold,
                         std::vector<Track>& tracks);

}  // namespace mbtfm::beads
