/// Inside of the bead tracker: what moved the image as a whole.
#pragma once

#include <optional>
#include <vector>

#include "segment/beads/at_rest.h"

namespace mbtfm::beads {

/// What may have moved an image as a whole: a shift alone, or turn, growth and shear beside it.
enum class Drift { translation, affine };

/// Standard errors of a motion's numbers.
struct MotionErrors {
  double shift = 0;  ///< of a component, at the centre
  double turn_rad = 0, growth = 0;
  double shear = 0;  ///< of stretch and of skew
};

struct FarField {
  AffineMotion drift;
  MotionErrors errors;
  double linear_chi_squared = 0;  ///< of turn, growth, stretch and skew together, over their covariance: 4 expected
  double over_noise = 0;          ///< the same over what the beads' noise alone makes of them
  double rms = 0;                 ///< of a bead's component about drift and the cell's tail
  double noise = 0;               ///< the same from the median, which outliers do not move
  bool is_at_rest = false;        ///< some part of the picture is; otherwise the drift is that of all beads
};

/// What all beads do together, and what of it turned, grew or sheared.
struct WholeMotion {
  RestingField rest;
  std::vector<FarField> of;  ///< one for each of the kinds asked for
};

/// Drift from the squares that are at rest (at_rest.h).
///
/// Even there the gel moves: a cell's displacement falls with its distance as slowly as 1/r². So they are fitted with a
/// drift and the field of balanced forces (a cell at rest exerts no net force) in what is not at rest:
///
///   u(x) = d(x) + Σ_k [K(x − x_k) − K̄(x)] f_k,   K = [ (1−nu) 1 + nu e eᵀ ] / r  (Cerruti, nu = 1/2)
///
/// K̄ the mean over the x_k, 1/r softened within a patch. Where what moves reaches the border, the x_k go on beyond it.
/// The forces have a normal prior whose width is that of largest evidence (MacKay, Neural Comput 4:415, 1992), so that
/// the drift's standard error holds what the tail leaves open; d has none.
/// Where no part is at rest (a layer of cells fills the picture) the forces in the picture balance, more or less, and
/// the drift is fitted to all squares alike.
/// @param corner  of the picture, which is width x height; all lengths in one unit
WholeMotion whole_motion(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, Vec2 corner,
                         double width, double height, const std::vector<Drift>& kinds);

}  // namespace mbtfm::beads
