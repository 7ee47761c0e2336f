#include "pipeline/numerics/distributions.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/distributions/non_central_t.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

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

}  // namespace mbtfm::numerics
