/// Motion that all beads share besides the displacement by forces: shift, turn, growth and shear of one picture against
/// the other, as after a change of focus or of temperature. It is found with the forces by least squares, so that
/// none of it is taken for force, whatever its size, and what the beads cannot separate from it is in the error bars.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/inverse/rows.h"
#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/affine_motion.h"
#include "pipeline/contract/figures.h"
#include "pipeline/stage/effects.h"

namespace mbtfm::tensions {

struct EnsembleFit;

/// Of no places: 0.
/// @param place  of each
template <class Things, class Place = std::identity>
Vec2 centre_of(const Things& things, Place place = {}) {
  Vec2 sum;
  for (const auto& thing : things) sum += std::invoke(place, thing);
  return (1 / std::max<double>(1, static_cast<double>(things.size()))) * sum;
}

using inverse::affine_motions;

/// How much of each motion the fit finds besides, with standard errors; in the order of the data's motions.
struct MotionsBeside {
  VectorXd values, sigma;
};
MotionsBeside motions_beside(const LinearData& data, const EnsembleFit& fit);

/// Standard deviations that these motions have between two pictures of one dish, where forces beyond an image may look
/// like them; none for shift and turn, which hang on how the dish was put back.
///
/// A change of focus or of temperature changes lengths by 0.1 to 0.3 %, and nothing by 1 %.
inline constexpr double kUsualGrowth = 0.003;

/// A common motion with the standard errors of its numbers, in the order of affine_motions().
struct FoundMotion {
  AffineMotion motion;  ///< um
  VectorXd sigma;
  VectorXd out_of_plane = {};  ///< in space: shift into the gel (um), turns about x and y (rad)
};
/// @param motions  the first ones those of affine_motions()
FoundMotion common_motion_among(const MotionsBeside& motions, const LinearData& data);

/// Of a component, over these places.
double rms_um(const AffineMotion& motion, const std::vector<Vec2>& places_um);

/// What all beads do together that is not affine, as stitched tiles, a rolling shutter or a lens make it: displacements
/// along the surface of second and third degree in x and y, fourteen numbers. By a score test.
struct CurvedMotion {
  double chi_squared = 0;  ///< 14 degrees of freedom where there is none
  double rms_um = 0;       ///< of the beads' displacement by the best of them, the tensions following
};
CurvedMotion curved_motion_beside(const EnsembleFit& fit);

/// Always on but where it is switched off: a motion too small to be noticed still shifts the total force by some of its
/// standard errors, and what it costs where there is none is little (docs/effects.md).
bool allows_common_motion(const stage::EffectSwitches& switches);
/// @param found  none where it is off
Effect common_motion_effect(Switch setting, const std::optional<FoundMotion>& found);
/// Of fit.json.
Figures figures_of(const FoundMotion& found);

/// "growth 0.12 +- 0.01 %, turn ..."
std::string sentence_of(const FoundMotion& found);

}  // namespace mbtfm::tensions
