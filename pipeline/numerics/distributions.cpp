#include "pipeline/numerics/distributions.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/distributions/non_central_t.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

namespace mbtfm::numerics {

namespace math = boost::math;

double normal_below(double z) { return cdf(math::normal(), z); }
double normal_above(double z) { return cdf(complement(math::normal(), z)); }
double normal_quantile(double probability) { return quantile(math::normal(), probability); }

double student_above(double degrees, double t) { return cdf(complement(math::students_t(degrees), t)); }
double student_quantile(double degrees, double probability) { return quantile(math::students_t(degrees), probability); }

double student_power(double degrees, double shift, double limit) {
  const math::non_central_t t(degrees, shift);
  return cdf(complement(t, limit)) + cdf(t, -limit);
}

double chi_squared_above(double degrees, double value) { return cdf(complement(math::chi_squared(degrees), value)); }
double chi_squared_below(double degrees, double squared_mean, double value) {
  return cdf(math::non_central_chi_squared(degrees, squared_mean), value);
}

double fisher_above(double numerator_degrees, double denominator_degrees, double f) {
  return cdf(complement(math::fisher_f(numerator_degrees, denominator_degrees), f));
}

namespace {

constexpr double kTail = 0.025, kQuantile = 1.959963984540054;

/// That so short a length or a shorter one is found. Lengths are in units of the error.
double probability_below(double found, double truth) { return chi_squared_below(2, truth * truth, found * found); }

/// The true length at which that is `probability`, which falls with it.
double truth_at(double found, double probability, double low, double high) {
  constexpr int kHalvings = 60;  // to rounding
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = (low + high) / 2;
    (probability_below(found, middle) > probability ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace

MagnitudeInterval magnitude_interval_95(double magnitude, double sigma) {
  if (!std::isfinite(sigma)) return {0, std::numeric_limits<double>::infinity()};
  if (!(sigma > 0)) return {magnitude, magnitude};
  constexpr double kLong = 50;  // an error across adds 1/(2·50) of an error to the length, to both sides the same
  const double found = magnitude / sigma;
  if (found > kLong) {
    const double mean = std::sqrt(found * found - 1);
    return {sigma * (mean - kQuantile), sigma * (mean + kQuantile)};
  }
  const double of_none = -std::expm1(-found * found / 2);  // P(R | 0)
  const double furthest = found + 5;  // P(R | R + 5) is below 1e-6, that of none times the tail not
  MagnitudeInterval interval;
  if (of_none > 1 - kTail) interval.low = sigma * truth_at(found, 1 - kTail, 0, furthest);
  const double smallest = std::sqrt(-2 * std::log(kTail));  // what R = 0 allows
  interval.high = found < 1e-3 ? sigma * (found + smallest) : sigma * truth_at(found, kTail * of_none, 0, furthest);
  return interval;
}

}  // namespace mbtfm::numerics
