/// What all beads of a stack do together beside the cell's pull.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/contract/words.h"

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

/// A bead that was followed.
struct Moved {
  Vec3 place_um, displacement_um;
  double sigma_um = 0, sigma_z_um = 0;
};

/// u = shift + turn x (place - centre) + (slice drift at z, across): what is common to the beads at rest.
struct CommonMotion {
  Vec3 centre_um, shift_um, shift_sigma_um;
  double turn_rad = 0, turn_sigma_rad = 0;  ///< about z, from +x towards +y
  std::vector<double> z_um;                 ///< places along z, rising
  std::vector<Vec2> slices_um;              ///< drift there beyond the shift; linear between
  std::vector<double> slices_sigma_um;      ///< standard error of each component, with that of the shift
  std::vector<double> drift_sigma_um;       ///< without it
  double slice_drift_ratio = 0;             ///< square root of twice the gain in log likelihood by that drift
  bool has_slice_drift = false;             ///< it is part of the motion; otherwise only told
  double share_at_rest = 0;                 ///< of the beads

  Vec3 at(Vec3 place_um) const;
  Vec3 drift_um_at(double z_um) const;          ///< zero where it is not part of the motion
  double drift_sigma_um_at(double z_um) const;  ///< of a component
};

/// Where the slices lie. step_um = 0: not known.
struct Slices {
  double first_um = 0, step_um = 0;
};

/// By robust least squares: beads that the cell moves do not count. Their share is not known before; the scale is that
/// of the quietest third, so that up to two thirds may move. A bead's picture is about as long as two slices, so its
/// place moves by what is linear between those of the slices; where beads are few, of every second one, and so on. How
/// much of the mean at each depth is the stage's: stage_by_depth(). On `automatic` the drift belongs to the motion
/// where the ratio is above 3.
CommonMotion common_motion(const std::vector<Moved>& beads, Switch slice_drift, const Slices& slices);

}  // namespace mbtfm::stacks
