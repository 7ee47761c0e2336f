/// What all beads do together, and what of it is taken off.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/effects.h"
#include "segment/beads/track.h"

namespace mbtfm::beads {

struct MotionTaken {
  AffineMotion motion;  ///< what is taken off
  CommonMotion common;  ///< what was found, in the unit of the positions for um
  Effect affine;        ///< whether turn, growth and shear are taken off
  double rms = 0, noise = 0;
  /// Turn, growth and shear are found by more than their errors and more than the tolerance, whether taken off or not.
  bool is_affine = false;
  bool is_large = false;  ///< they move the border by more than `large`, and are most of what is at rest does
  int n_moving = 0;       ///< squares of the picture that do not rest
};

/// automatic: turn, growth and shear are taken off where they displace the border by more than the tolerance, of the
/// largest displacement, and are no noise: their chi² of four numbers is above 16.3, which one picture in 370 has by
/// chance, as often as a normal number has three standard deviations.
MotionTaken motion_taken(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, Vec2 corner,
                         double width, double height, Switch setting, double tolerance, double large);

/// "a turn of 0.3 +- 0.001 degrees, growth of ..."
std::string affine_in_words(const CommonMotion& common);

}  // namespace mbtfm::beads
