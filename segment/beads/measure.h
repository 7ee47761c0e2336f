/// Inside of the bead tracker: how far each bead has gone, and whether that can be.
#pragma once

#include "segment/beads/scene.h"

namespace mbtfm::beads {

/// Measure each bead with the narrow window; flag what is less similar than the picture's noise explains.
void measure(const Scene& scene, double least_similarity, std::vector<Track>& tracks);

/// Registered from where it went, a bead must come back to where it was; no two beads go to one place.
void verify(const Scene& scene, std::vector<Track>& tracks);

/// Where beads are loose, find again what no window found, or what its neighbours contradicted: matched with the spots
/// that are left over (match.h), measured without the others' pictures, verified. Where motions are expected, beads
/// whose neighbours do not tell them are matched anew, too: one whose spot is another's is moved, or flagged ambiguous.
/// @param expected  by bead, px: its motion, as far as it is known; empty: it is not
void recover(const Scene& scene, double least_similarity, std::vector<Track>& tracks,
             const std::vector<Vec2>& expected = {});

}  // namespace mbtfm::beads
