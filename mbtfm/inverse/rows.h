/// Data by row, over their errors, and blocks of unknowns besides those that are asked for.
#pragma once

#include <optional>

#include "pipeline/contract/beads.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::inverse {

/// x, y of each displacement in turn (um): 2·beads.
VectorXd components_of(const DisplacementField& beads);

/// Displacements in the plane times the roots of their weights, 1/sigma² by bead or equal ones where not all beads
/// state their errors, scaled so that all weights have one sum.
struct WeightedBeads {
  VectorXd roots;                         ///< by component: 2·beads
  VectorXd data;                          ///< 2·beads
  std::optional<double> stated_variance;  ///< of a component of `data`; none where no errors are stated
};
/// @param sum  of the weights; of the number of beads their mean is one
WeightedBeads weighted(const DisplacementField& beads, double sum);

/// The six affine motions of unit size as displacements of places, 2·beads × 6, about their centre: shift (um), then
/// turn, growth and two shears (relative).
MatrixXd affine_motions(const DisplacementField& beads);
/// The same in space, 3·beads × 9: these, a growth into the gel, too, then a shift into it and the turns about x and y.
MatrixXd affine_motions(const std::vector<Vec3>& beads_um);

/// P W: rows times their weights W, and with the columns C of the blocks as further unknowns of any size: P = 1 −
/// QQᵀ with Q an orthonormal basis of W C. What is fitted to such rows is what a fit with these blocks finds (Frisch &
/// Waugh, Econometrica 1 (1933) 387).
class Rows {
 public:
  /// @param weights  W, by row: the root of a weight over the standard error
  /// @param beside   C, rows × columns; no columns: no blocks
  Rows(VectorXd weights, const MatrixXd& beside);

  MatrixXd of(const MatrixXd& by_row) const;            ///< P W X
  MatrixXd transposed(const MatrixXd& weighted) const;  ///< W P Y
  /// The sizes of the blocks' columns that explain rows best: columns × any number.
  MatrixXd beside_in(const MatrixXd& by_row) const;
  /// (Cᵀ W² C)⁻¹: their covariance by rows of variance one, if all else is known.
  MatrixXd covariance_beside() const;
  Index n_beside() const { return basis_.cols(); }  ///< numbers that the blocks take

 private:
  VectorXd weights_;
  MatrixXd weighted_beside_;  ///< W C
  MatrixXd basis_;            ///< Q
};

/// Of length one; of no vector the first axis.
VectorXd direction_of(const numerics::VectorView& vector);
/// Standard deviation of a vector along its direction. @param covariance  of its components
double error_along(const numerics::VectorView& vector, const numerics::MatrixView& covariance);

}  // namespace mbtfm::inverse
