/// Which bead of one stack is which of the other.
#pragma once

#include <optional>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/contract/words.h"

namespace mbtfm::stacks {

/// What is wrong with a bead's track.
enum class TrackFlag { none, no_partner, ambiguous, neighbours_disagree, edge, saturated };
constexpr auto words(TrackFlag) {
  return std::array{"", "no partner", "ambiguous", "neighbours disagree", "edge", "saturated"};
}

/// A bead in one stack.
struct PlacedBead {
  Vec3 position_um;
  double brightness = 0;             ///< 0: not known
  double sigma_um = 0;               ///< standard error along x and y
  double sigma_z_um = 0;             ///< standard error along z
  TrackFlag flag = TrackFlag::none;  ///< what is wrong with it in its own stack
};

struct MatchParameters {
  double largest_displacement_um = 0;  ///< after the common motion; 0: three mean distances of beads
  double outlier_threshold = 4;        ///< in standard deviations
};

/// A turn about z with a shift: y = R (x - centre) + centre + shift.
struct RigidMotion {
  Vec3 centre, shift_um;
  double turn_rad = 0;
  Vec3 at(Vec3 x) const;
};

struct Match {
  int partner = -1;  ///< in the stressed stack; -1: none
  TrackFlag flag = TrackFlag::no_partner;
  double similarity = 0;                ///< share of the neighbours that are met with again
  Vec3 from_neighbours_um;              ///< displacement less that which the neighbours tell
  double sigma_um = 0, sigma_z_um = 0;  ///< of that difference, by the standard errors of all of them
  bool has_neighbours = false;
};

struct Matching {
  std::vector<Match> matches;  ///< by bead of the relaxed stack
  RigidMotion first;           ///< of all beads alike, to begin with
  double spacing_um = 0;       ///< mean distance of beads
};

/// Match by the pattern of the nearest neighbours, which is one of a kind, and by light.
///
/// 1. Some hundred beads are looked for everywhere: where the vectors to a bead's nearest neighbours are met with again
///    about another bead, within the tolerance of a strained gel, the two are the same. Their common shift and turn is
///    where all others are looked for (turns are tried out up to 45° where there is none without).
/// 2. All beads are compared with those within `largest_displacement_um` of there; a match is the best of both sides.
/// 3. The neighbours' motion, a robust affine fit, says where a bead went and how its surroundings are strained; all
///    are looked for again, nearer and with less tolerance. Three times.
/// 4. What contradicts the affine motion of its neighbours by more than `outlier_threshold` is flagged.
///
/// After Legant et al., Nat Methods 7:969 (2010), whose feature vectors these are, with strain taken out.
/// @throws beads::NotFollowed where the patterns do not meet
Matching match(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
               const MatchParameters& parameters, int threads);

}  // namespace mbtfm::stacks
