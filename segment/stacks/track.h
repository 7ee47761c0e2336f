/// Displacement in the volume of a gel from two stacks of its beads: pulled by the cell, and relaxed.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/axes.h"
#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/words.h"
#include "pipeline/stage/parameters_fwd.h"
#include "segment/beads/track.h"
#include "segment/stacks/motion.h"
#include "segment/stacks/spots.h"

namespace mbtfm::stacks {

using beads::TrackFlag;

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
  Vec3 from_neighbours_um;              ///< displacement less that which the neighbours show
  double sigma_um = 0, sigma_z_um = 0;  ///< of that difference, by the standard errors of all of them
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

/// Whether beads are followed in the plane of the images or in space.
enum class Dimensions {
  automatic,  ///< in space where z_points is given, which means nothing in the plane
  plane,
  space
};
constexpr auto words(Dimensions) { return std::array{"auto", "plane", "space"}; }

/// Fewer slices say nothing of a bead's picture along z.
inline constexpr int kFewestSlices = 8;

struct StackParameters {
  Dimensions dimensions = Dimensions::automatic;
  std::optional<double> z_step_um;    ///< of the stage; unset: from the files
  std::optional<ZPoints> z_points;    ///< from the first slice to the last
  double first_slice_z_um = 0;        ///< z of the outer face of the slice that lies nearest to the surface
  double refractive_index_ratio = 1;  ///< of gel and immersion; 1: they are matched
  Switch slice_drift = Switch::automatic;
};
void declare(stage::ParameterList& list, StackParameters& parameters);

/// Voxels to places in the gel.
struct Scale {
  double pixel_um = 0, step_um = 0;  ///< of the focus: the stage's, times the ratio of the refractive indices
  double first_um = 0;
  ZPoints z_points = ZPoints::into_gel;
  int depth = 0;
  Vec3 place_um(Vec3 voxel) const;
  Slices slices() const { return {first_um + 0.5 * step_um, step_um}; }
};

/// The beads of a stack in the gel, those at the rim and the saturated ones flagged.
std::vector<PlacedBead> placed(const Detection& detection, const Scale& scale);

struct Followed {
  std::vector<BeadInSpace> field;  ///< one entry for each bead of the relaxed stack, good or flagged
  CommonMotion common;             ///< taken off the field; its turn beyond `first`'s
  RigidMotion first;
  double spacing_um = 0;  ///< mean distance of beads
  int n_good = 0, n_stressed = 0;
  double neighbours_um = 0, neighbours_z_um = 0;  ///< how far beads are from what their neighbours show, robust sd
  double error_ratio = 1,
         error_ratio_z = 1;  ///< that over what the pictures' errors explain; in each sigma where above 1
  double light_ratio = 0;    ///< of the stressed beads' light over the relaxed ones'; 0: not known
  std::map<std::string, int> flags;
};

/// Match, take off what is common, weigh the errors by what neighbours show of them.
/// @throws beads::NotFollowed where there are too few beads, or the two stacks do not show the same
Followed follow(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
                const MatchParameters& matching, Switch slice_drift, const Slices& slices, int threads);

}  // namespace mbtfm::stacks
