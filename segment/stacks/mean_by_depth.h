/// What of the mean motion at each depth is the stage's, and what the gel's.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace mbtfm::stacks {

/// Mean motion along x and y by place along z, as beads have it.
struct MeanByDepth {
  std::vector<double> z_um;            ///< rising
  Eigen::MatrixX2d um;                 ///< places × components
  Eigen::MatrixXd noise_um2;           ///< covariance of a component over the places, by the noise of the beads
  std::vector<double> field_um;        ///< by place: scatter of the gel's own motion there, robust, of a component
  std::vector<double> beads_by_place;  ///< how many each mean is of
};

struct StageByDepth {
  Eigen::MatrixX2d um;             ///< the stage's part, the common shift in it
  Eigen::VectorXd sigma_um;        ///< standard error of each component, by place
  Eigen::Vector2d shift_um;        ///< mean over the places
  double shift_sigma_um = 0;       ///< of each component
  double log_likelihood_gain = 0;  ///< of a stage that moved from slice to slice over one that did not
  Eigen::MatrixX2d drift_um;       ///< um less shift_um; zero where the stage is taken for still
  Eigen::VectorXd drift_sigma_um;  ///< of each component of that, by place
};

/// Where a cell fills the view its gel moves on the average, too, the more the nearer to the surface. That mean changes
/// smoothly with depth and is no larger than the scatter of the field it is the mean of:
///
///   mean = shift + gel + stage + noise
///   gel    normal, covariance a_i a_j exp(−(z_i − z_j)² / 2 l²) + a_i²/n_i (i = j), a the scatter, n the beads
///   stage  normal, steps of variance q from place to place and jitter of variance t² at each
///
/// l, q and t by the greatest restricted likelihood, the stage then by its conditional mean (best linear unbiased
/// prediction: Robinson, Statist. Sci. 6, 15 (1991)). So a slow drift is found from depths that are at rest, a jump
/// from slice to slice at any depth, and of neither more is taken off than the gel cannot have done itself.
/// @param may_drift  whether q and t may differ from 0
StageByDepth stage_by_depth(const MeanByDepth& mean, bool may_drift);

}  // namespace mbtfm::stacks
