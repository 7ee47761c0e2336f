/// Inside of the bead tracker: what moved the image as a whole.
#pragma once

#include <vector>

#include "pipeline/contract/types.h"

namespace mbtfm::segment {

/// What may have moved an image as a whole; each includes those before it.
enum class Drift { translation, rotation, similarity };

/// A small motion of the whole: shift, turn and growth about the image's centre.
struct GlobalMotion {
  Vec2 shift;
  double turn_rad = 0;  ///< from +x towards +y
  double growth = 0;    ///< relative
  Vec2 centre;
  Vec2 at(Vec2 place) const {
    const Vec2 d = place - centre;
    return {shift.x + growth * d.x - turn_rad * d.y, shift.y + growth * d.y + turn_rad * d.x};
  }
};

struct FarField {
  GlobalMotion drift;         ///< px
  double rms = 0;             ///< px, of a component about drift and the cell's tail
  double noise = 0;           ///< px, the same from the median, which outliers do not move
  double turn_sigma_rad = 0;  ///< standard error of drift.turn_rad, where the frame is at rest and may be turned
  double turn_rad = 0;        ///< of the frame as a whole, whether taken for drift or not
  bool is_turned = false;     ///< by more than a pixel, and that is most of what it does besides its shift
  int n_beads = 0;
  bool is_at_rest = false;  ///< the frame is quieter than the rest; otherwise the drift is that of all beads
};

/// Drift from the beads in a frame along the border of the image, `margin` px wide.
///
/// Even there the gel moves: a cell's displacement falls with its distance as slowly as 1/r². So the frame is fitted
/// with a drift and the field of forces inside of it, which balance each other (a cell at rest exerts no net force):
///
///   u(x) = d(x) + Σ_k K(x − x_k) f_k,   Σ f_k = 0,   K = [ (1−nu) 1 + nu e eᵀ ] / r  (Cerruti, nu = 1/2)
///
/// with the x_k on a grid of a twelfth of the inner field, 1/r softened within a patch; ridge regression.
/// Whether it moves less than the rest is asked beyond `noise` (px), the standard deviation of a bead's component.
/// Where the frame moves as much as the rest (a layer of cells fills the picture) no place is at rest: the forces in
/// the picture balance, more or less, and the drift is fitted to all beads alike.
/// @returns one for each of the kinds. The turn and the growth are the last unknowns of one elimination: to ask for
/// them
///   beside the shift costs next to nothing.
std::vector<FarField> far_fields(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements,
                                 double width, double height, double margin, const std::vector<Drift>& kinds,
                                 double noise);

}  // namespace mbtfm::segment
