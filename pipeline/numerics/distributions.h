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

}  // namespace mbtfm::numerics
