/// What the beads say, weighed, and what they say of tractions alone.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "pipeline/contract/effects.h"
#include "pipeline/contract/figures.h"

namespace mbtfm::spatial {

struct Observed;
struct Problem;
struct SpatialReconstruction;

/// Shift along each axis that the beads have (um) and turn about z (rad), of unit size, as rows of `observed`. A stage
/// that moved between two stacks and a dish that was put back do this to all beads, and where a cell fills the view
/// their tracker cannot tell it from what the cell does.
Eigen::MatrixXd common_motions(const Observed& observed);

/// P W S: rows over their standard errors (S) and by the roots of the loss's weights (W), and with the common motions C
/// as further unknowns, of any size: P = 1 − Q Qᵀ, Q an orthonormal basis of W S C (Frisch & Waugh, Econometrica 1
/// (1933) 387).
class Rows {
 public:
  Rows(const Problem& problem, const Eigen::VectorXd& weights_by_row);

  Eigen::MatrixXd of(const Eigen::MatrixXd& by_row) const;
  Eigen::MatrixXd transposed(const Eigen::MatrixXd& weighed) const;
  /// The sizes of the common motions that explain rows best: motions × columns.
  Eigen::MatrixXd common_in(const Eigen::MatrixXd& by_row) const;
  Eigen::Index n_common() const { return common_.cols(); }

 private:
  Eigen::VectorXd roots_;
  Eigen::MatrixXd weighed_common_;  ///< W S C
  Eigen::MatrixXd common_;          ///< Q
};

/// The motion that was found beside tractions, in the order of common_motions().
struct CommonMotionInSpace {
  Eigen::VectorXd values, sigma;
};
/// None where the problem has no common motions, or the reconstruction no standard errors.
std::optional<CommonMotionInSpace> common_motion_beside(const Problem& problem, const SpatialReconstruction& found);

/// Always on but where it is switched off, as on flat gels, or the method has no place for it.
Effect common_motion_effect(Switch setting, const Problem& problem, const std::optional<CommonMotionInSpace>& found);
Figures figures_of(const CommonMotionInSpace& found);

}  // namespace mbtfm::spatial
