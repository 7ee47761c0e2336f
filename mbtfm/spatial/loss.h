/// What the misfit of a bead costs: sum of rho(|r_b|) with r_b = S (u − G t), S = 1/sigma by direction, so that beads
/// that are wrong cannot pull the tractions away and no axis of the plane is special.
/// docs/theory/tractions-in-space.md (26).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mbtfm/spatial/parameters.h"

namespace mbtfm::spatial {

struct Observed;

/// Weight psi(r)/r of a bead whose residual has this length, in standard deviations of a component:
/// l2 1 | l1 1/r | huber min(1, k/r) | biweight (1 − (r/c)²)². k and c keep 95 % efficiency where the noise is Gaussian
/// in so many components (the equation of Maronna, Martin & Yohai, Robust Statistics, 2006, 6.4, solved for each).
double loss_weight(BeadLoss loss, double residual, Eigen::Index n_components);
/// Median length of Gaussian vectors with components of variance one.
double median_length(Eigen::Index n_components);
/// Of l2 and of mixture, whose weights are given, all formulas for least squares hold as they are.
constexpr bool weighs_by_residual(BeadLoss loss) { return loss != BeadLoss::l2 && loss != BeadLoss::mixture; }

/// The loss as least squares about a residual.
struct Weighing {
  Eigen::VectorXd by_row;  ///< weights of the squares of S (u − G t), all at most 1
  double scale = 1;        ///< standard deviation of a component, in units of sigma, that most beads have
  /// So much one datum varies, and so many of them there are, as weighed: with these, formulas for least squares hold.
  double variance = 1, n_data = 0;
};

/// @param residual  S (u − G t)
/// @param degrees   of freedom that the tractions have taken: what is left of noise where they followed it
/// @param good     by bead, of a mixture: the probability that it is (neighbours.h), which is its weight
Weighing weigh(BeadLoss loss, const Observed& observed, const Eigen::VectorXd& residual, double degrees,
               const std::vector<double>& good = {});

}  // namespace mbtfm::spatial
