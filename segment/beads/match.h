/// Inside of the bead tracker: which spot of the stressed image is which bead, where windows cannot tell.
#pragma once

#include <optional>
#include <vector>

#include "segment/beads/scene.h"

namespace mbtfm::beads {

/// Match the beads that have no good track with the spots of the stressed image that no good track leads to.
///
/// Where beads are loose and the field is steep no two beads of a window move alike, so none is found by its window;
/// and what the beads outside a peak predict for its inside is far too little. Then all pairings within reach are
/// weighed together by match probabilities (Baek & Lee, Exp Fluids 22:23, 1996; Ohmi & Li, Meas Sci Technol 11:603,
/// 2000). The odds of bead k and spot b against no match are
///
///   o_kb = (1 − p0)/p0 · 1/(A rho) · light_kb · Π_j [ A f(u_kb | j) ]^w_j,   P_kb = o_kb / (1 + Σ_b' o_kb' + Σ_k'
///   o_k'b)
///
/// (both sums without o_kb twice), where A is the area searched, rho the density of free spots, light_kb how much
/// likelier than any other bead's this spot's light is, and f the density of the step u_kb that the bead j nearby lets
/// expect: a good track's own step, or, of a bead that has none, those of its candidates by their probabilities,
/// spread by a Student density of two degrees of freedom with the variance 2 scatter² + (strain · distance)². The P
/// are found by iteration from small values.
/// Where motions are expected, u_kb is the step beside that, and the strain what is expected wrongly of it.
///
/// @param scatter_px  of single beads about their neighbours, a component
/// @param expected  by bead, px; empty: nothing is
/// @return by bead of the relaxed image, the index of its spot in the stressed one
std::vector<std::optional<int>> matched_spots(const Scene& scene, const std::vector<Track>& tracks, double scatter_px,
                                              const std::vector<Vec2>& expected = {});

}  // namespace mbtfm::beads
