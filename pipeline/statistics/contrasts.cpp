/// What a fitted mixed model says of sums and differences of its means.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/distributions.h"
#include "pipeline/statistics/mixed_model.h"

namespace mbtfm::statistics {

namespace {

double satterthwaite_degrees(const MixedFit& fit, const VectorXd& weights) {
  const double variance = weights.dot(fit.covariance * weights);
  VectorXd slope(static_cast<Index>(fit.covariance_slopes.size()));
  for (Index k = 0; k < slope.size(); ++k) slope[k] = weights.dot(fit.covariance_slopes[k] * weights);
  const double spread = slope.dot(fit.variance_covariance * slope);
  const double most = fit.n_observations - static_cast<double>(fit.mean.size());
  return spread > 0 ? std::clamp(2 * variance * variance / spread, 1.0, std::max(1.0, most)) : std::max(1.0, most);
}

}  // namespace

Contrast by_students_t(double estimate, double standard_error, double degrees) {
  Contrast c{.estimate = estimate, .standard_error = standard_error, .degrees = degrees};
  c.t = c.estimate / c.standard_error;
  c.p_value = std::min(1.0, 2 * numerics::student_above(c.degrees, std::abs(c.t)));
  const double half = numerics::student_quantile(c.degrees, 0.975) * c.standard_error;
  c.low = c.estimate - half;
  c.high = c.estimate + half;
  return c;
}

Contrast contrast_of(const MixedFit& fit, const VectorXd& weights) {
  return by_students_t(weights.dot(fit.mean), std::sqrt(weights.dot(fit.covariance * weights)),
                       satterthwaite_degrees(fit, weights));
}

Contrast with_positive_interval(Contrast mean) {
  if (mean.estimate <= 0) {
    mean.low = std::max(0.0, mean.low);
    return mean;
  }
  const double relative = (mean.high - mean.estimate) / mean.estimate;
  const double factor = std::min(std::exp(relative), 1 + 10 * relative);  // of two cells the power may be any
  mean.low = mean.estimate / factor;
  mean.high = mean.estimate * factor;
  return mean;
}

FTest test_all_zero(const MixedFit& fit, const MatrixXd& contrasts) {
  const MatrixXd spread = contrasts * fit.covariance * contrasts.transpose();
  const MatrixXd axes =
      numerics::symmetric_eigen(spread).vectors.transpose() * contrasts;  // independent contrasts, one a row
  const double q = static_cast<double>(contrasts.rows());
  FTest test{.numerator_degrees = q};
  double expected = 0;  // of q F
  for (Index i = 0; i < axes.rows(); ++i) {
    const Contrast c = contrast_of(fit, axes.row(i).transpose());
    test.f += c.t * c.t / q;
    expected += c.degrees > 2 ? c.degrees / (c.degrees - 2) : 0;
  }
  test.denominator_degrees = contrasts.rows() == 1 ? contrast_of(fit, axes.row(0).transpose()).degrees
                             : expected > q        ? 2 * expected / (expected - q)
                                                   : 2;
  test.p_value = numerics::fisher_above(q, test.denominator_degrees, test.f);
  return test;
}

}  // namespace mbtfm::statistics
