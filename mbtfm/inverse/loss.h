/// Robust losses: the sum of rho(|r_b|) over beads b in place of the sum of squares, r_b a residual of n components in
/// standard deviations, so that a few bad beads cannot pull the solution away and no axis is special. By weights
/// w(r) = psi(r) / r with psi = rho'.
#pragma once

#include <array>
#include <vector>

#include "pipeline/numerics/dense.h"

namespace mbtfm::inverse {

enum class Loss { squares, huber, tukey, l1 };
constexpr auto words(Loss) { return std::array{"squares", "huber", "tukey", "l1"}; }

/// squares 1 | huber min(1, k/r) | tukey (1 − (r/c)²)², 0 from c on | l1 1/r, no more than 100. k and c keep 95 %
/// efficiency where the noise is Gaussian in 1, 2 or 3 components, k = 1.345, 1.501, 1.628 and c = 4.685, 5.123, 5.490
/// (Maronna, Martin & Yohai, Robust Statistics, 2006, 6.4, solved for each); l1 keeps 79 % in the plane.
/// @param n_components  1 to 3
double weight(Loss loss, double residual, Index n_components);
/// Of residual vectors of n components each, one a vector. @param scale  standard deviation of a component
VectorXd weights_of(Loss loss, const numerics::VectorView& residual, double scale, Index n_components);

/// Median length of Gaussian vectors whose components have variance one (chi distribution).
double median_length(Index n_components);

/// Lengths of residual vectors of n components each.
std::vector<double> residual_lengths(const numerics::VectorView& residual, Index n_components);
/// Standard deviation of a component, as the median of the lengths has it; 0 where there are none.
double scale_of(std::vector<double> lengths, Index n_components);

/// Minimised in this order: tukey's loss has several minima and begins at that of huber's, which has one.
std::vector<Loss> in_turn(Loss loss);

/// What a loss makes of residuals.
struct Estimator {
  /// The factor on (Aᵀ W A)⁻¹, W the weights, that makes it the covariance, in the residuals' unit squared:
  /// s² E(psi²/n) E(w) / E((psi' + (n − 1) psi/r)/n)², E the mean over the vectors (Maronna et al., 10.3).
  double variance = 0;
  double square = 0;  ///< E(w r²/n)
};
/// @param scale  s: residuals are in units of it; more than 0
Estimator estimator_of(Loss loss, const std::vector<double>& lengths, double scale, Index n_components);

}  // namespace mbtfm::inverse
