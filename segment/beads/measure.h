/// Inside of the bead tracker: how far each bead has gone, whether that can be, which spot is which bead where windows
/// cannot show, what neighbours add, and how sharp and round beads are.
#pragma once

#include <optional>
#include <vector>

#include "segment/beads/scene.h"

namespace mbtfm::beads {

/// Measure each bead with the narrow window; flag what is less similar than the picture's noise explains.
void measure(const Scene& scene, double least_similarity, std::vector<Track>& tracks);

/// Registered from where it went, a bead must come back to where it was; no two beads go to one place.
void verify(const Scene& scene, std::vector<Track>& tracks);

/// Where beads are loose, find again what no window found, or what its neighbours contradicted: matched with the spots
/// that are left over (match.cpp), measured without the others' pictures, verified. Where motions are expected, beads
/// whose neighbours do not show them are matched again, too: one whose spot is another's is moved, or flagged
/// ambiguous.
/// @param expected  by bead, px: its motion, as far as it is known; empty: it is not
void recover(const Scene& scene, double least_similarity, std::vector<Track>& tracks,
             const std::vector<Vec2>& expected = {});

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

/// Size of the good beads in both images, from their light in Gaussian windows of one and of two bead sigmas:
///
///   sum A / sum B = R = (s² + s2²) / (s² + s1²),   s² = (s2² − R s1²) / (R − 1)
///
/// A, B: means of a bead's surroundings with the weights of s1 and of s2. Both are linear in the light, so noise moves
/// neither sum, and what lies beside a bead adds the same to both images. The standard error is that of a ratio of sums
/// over beads, each bead's share in both images taken together.
///
/// Their shape, from the means of (x² − y²) I and 2xy I with the weights of s1, which an even background leaves at
/// zero:
///
///   (s_x² − s_y²) = sum Q / sum (A − B) · (s2² − s1²) / (s² + s2²) · (s1² + s²)² / s1⁴
///
/// to first order in the difference; the same with 2xy for the diagonal directions (Gaussian-weighted moments as of
/// Kaiser, Squires & Broadhurst, ApJ 449:460, 1995).
BeadSizes sizes_of(const Scene& scene, const std::vector<Track>& tracks);

/// A bead that moved in the pictures, by the cell or the stage, is looked for at its place in the other picture, beside
/// itself: in a fit of two spots, less what the same fit finds in the other picture, where neighbours and the lens add
/// the same. The median of many, by their information.
/// @param turn  by which the stressed image was turned back
Ghosts ghosts_of(const Scene& scene, const std::vector<Track>& tracks, const BeadSizes& sizes,
                 const std::optional<Turn>& turn);

struct Pooled {
  Vec2 u;               ///< px
  double sigma_px = 0;  ///< standard error of a component
};

struct Pooling {
  std::vector<Pooled> beads;
  /// Standard deviation (px) of single beads beyond the errors of their registration: beads that sit loose, at other
  /// depths or on others' flanks.
  double scatter_px = 0;
};

/// Weigh each good bead's own measurement (variance s²) with what the beads around predict for it (variance T²):
///
///   u = a u_own + (1 − a) u_predicted,  1/a = 1 + s²/(T² + L²),   sigma² = a² (s² + L²) + (1 − a)² T²
///
/// L is how far single beads scatter about the field: the weight is that of the bead's own place, which is the field's
/// plus such a step, sigma the standard error of the field. The prediction is an affine or a curved motion through the
/// beads around, the one that misses less; T² is how far such predictions miss there, beyond the measurements' own
/// errors, from the neighbours' misfits: large where the field is steep, where a bead is left to itself, small where
/// noise is all there is. Nothing is pooled beyond a standard error of 0.02 px, which is small against what a field is
/// used for, so that beads keep errors of their own.
///
/// Beads further off than four standard deviations, T² by the median of the neighbours' misfits, are flagged
/// "neighbours disagree" if their light is strained neither as the gel is nor not at all, or as flag_unpulled() does.
/// @param threshold  of flag_unpulled()
Pooling pooled(const Scene& scene, double threshold, std::vector<Track>& tracks);

}  // namespace mbtfm::beads
