/// Probabilities and quantiles of the distributions that tests and intervals need. Boost's, compiled here once: each
/// place that names them costs seconds.
#pragma once

namespace mbtfm::numerics {

/// Of the standard normal distribution: P(Z <= z), P(Z > z) and the z with P(Z <= z) = probability.
double normal_below(double z);
double normal_above(double z);
double normal_quantile(double probability);

/// Of Student's t.
double student_above(double degrees, double t);
double student_quantile(double degrees, double probability);

/// Of Student's t with a shifted mean, to either side of ±limit: the power of a two-sided test.
/// @param shift  the true difference over its standard error
double student_power(double degrees, double shift, double limit);

/// Of χ², and of the squared length of a vector of normal components with this squared mean.
double chi_squared_above(double degrees, double value);
double chi_squared_below(double degrees, double squared_mean, double value);

/// Of Fisher's F.
double fisher_above(double numerator_degrees, double denominator_degrees, double f);

// How long a vector is whose components are known with an error.

struct MagnitudeInterval {
  double low = 0, high = 0;
};

/// 95 % interval of the length F of a plane vector, from the length R that was found, both components with the same
/// normal error σ. R follows Rice's distribution, P(R) = 1 − Q₁(F/σ, R/σ) with Marcum's Q, and
///
///   low:   P(R | low)  = 0.975, 0 where P(R | 0) is less
///   high:  P(R | high) = 0.025 P(R | 0)
///
/// Covers the true length in 95 % of the cases where it is 5 σ or more, in 97.5 % up to 2 σ; never negative,
/// never empty. Without the factor P(R | 0), which is 1 from 3 σ on, a small R would leave no length at all.
/// @param sigma  0: the length is exact; infinite: so is `high`
/// Source: Rice, Bell Syst. Tech. J. 24, 46 (1945), (3.10-11); Read, J. Phys. G 28, 2693 (2002), for the factor.
MagnitudeInterval magnitude_interval_95(double magnitude, double sigma);

}  // namespace mbtfm::numerics
