/// Inside of the bead tracker: which part of the picture is at rest.
#pragma once

#include <vector>

#include "pipeline/contract/affine_motion.h"
#include "pipeline/contract/geometry.h"

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
  const FieldCell& at(int i, int j) const { return cells[static_cast<std::size_t>(j) * nx + i]; }
};

/// Find the largest part of the picture that moves as one affine body within its noise and the tail of what is pulled.
///
/// The picture is divided into squares of half a dozen beads. The body's motion is a mode over them: least squares with
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

}  // namespace mbtfm::beads
