/// Inside of the bead tracker: which part of the picture is at rest, and what moved the image as a whole.
#pragma once

#include <string>
#include <vector>

#include "segment/beads/track.h"

namespace mbtfm::beads {

/// The beads of a square of the picture taken together.
struct FieldCell {
  Vec2 place, u;       ///< means, without those that differ from the median by more than three robust sd
  int n_beads = 0;     ///< in the means; 0: none
  double spread = 0;   ///< robust standard deviation of a bead's component
  bool rests = false;  ///< it belongs to the rest of the picture that moves as one body
};

/// The largest displacement beside a motion; a hundredth of the beads may move further, as outliers do.
double largest_about(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements,
                     const AffineMotion& motion);

/// The picture in squares, row by row.
struct RestingField {
  Vec2 corner;
  double width = 1, height = 1;
  int nx = 0, ny = 0;
  double side = 1;  ///< of a square
  std::vector<FieldCell> cells;
  AffineMotion motion;                ///< roughly, of what rests
  double bead_noise = 0;              ///< standard deviation of a bead's component about its square
  double share_at_rest = 0;           ///< of the squares with beads
  double share_of_border_moving = 0;  ///< of the squares along the border, those that do not rest
  double share_of_border_pulled = 0;  ///< the same, those that move by a quarter of the largest displacement
  double pull_of_border = 0;          ///< largest motion along the border over the largest anywhere
  int n_moving = 0;                   ///< squares that do not rest
  double largest = 0;                 ///< 99 % of the beads move by less, beside the motion
  /// A cell pulls at more of the border than an adhesion near it does.
  bool is_cut() const { return share_of_border_pulled > 0.1; }
  /// That holds a place; beyond the picture the nearest.
  std::size_t square_of(Vec2 place) const;
  const FieldCell& at(int i, int j) const { return cells[static_cast<std::size_t>(j) * nx + i]; }
};

/// Find the largest part of the picture that moves as one affine body within its noise and the tail of what is pulled.
///
/// The picture is divided into squares of three to six beads. The body's motion is a mode over them: least squares with
/// the weights of Geman and McClure, 1/(1 + (r/s)²)², whose width s is narrowed step by step (Black & Rangarajan, Int J
/// Comput Vis 19:57, 1996), begun from the whole, its frame, its sides, its corners; the motion that most squares
/// follow counts. What follows it is at rest where it is connected with the border. So a cell may lie anywhere, or be
/// cut by the border: a frame along the border need not be at rest.
RestingField resting_field(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, Vec2 corner,
                           double width, double height);

/// Columns of the six unknowns shift x, y, turn, growth, stretch, skew; `d` from the centre.
struct GlobalColumns {
  double x[6], y[6];
};
inline GlobalColumns global_columns(Vec2 d) { return {{1, 0, -d.y, d.x, d.x, d.y}, {0, 1, d.x, d.y, -d.y, d.x}}; }

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
  FarField shifted;  ///< a shift alone
  FarField affine;   ///< turn, growth and shear beside it
};

/// Drift from the squares that are at rest.
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
                         double width, double height);

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
