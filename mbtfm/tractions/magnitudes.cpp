/// How large forces are that are known with errors.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/inverse/rows.h"
#include "mbtfm/tractions/traction.h"

namespace mbtfm::tractions {

namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// E|F| of F ~ N(mean, σ² 1), Rice's distribution: σ √(π/2) e⁻ʸ ((1 + 2y) I₀(y) + 2y I₁(y)), y = |mean|² / 4σ².
double mean_length(double squared_mean, double variance) {
  constexpr double kLong = 50;  // of y: the next term of the series is 1e-5 of the length
  if (!(variance > 0)) return std::sqrt(squared_mean);
  const double y = squared_mean / (4 * variance);
  if (y > kLong) return std::sqrt(squared_mean + variance);
  return std::sqrt(0.5 * std::numbers::pi * variance) * std::exp(-y) *
         ((1 + 2 * y) * std::cyl_bessel_i(0, y) + 2 * y * std::cyl_bessel_i(1, y));
}

/// Zero, and from a part of the least error to more than the largest force.
std::vector<double> deviations_for(double least_error_nN, double largest_nN) {
  constexpr double kStep = 1.6;  // normal distributions nearer than that are hardly distinguished
  std::vector<double> all = {0};
  for (double s = 0.5 * least_error_nN; s < 2 * largest_nN; s *= kStep) all.push_back(s);
  return all;
}

/// Shares of the columns that make the rows most likely, by expectation and maximisation.
VectorXd likeliest_shares(const MatrixXd& likelihoods) {
  constexpr int kSteps = 300;  // each raises the likelihood; the sum of magnitudes moves by less than 1e-3 after 100
  VectorXd shares = VectorXd::Constant(likelihoods.cols(), 1.0 / static_cast<double>(likelihoods.cols()));
  for (int step = 0; step < kSteps; ++step) {
    const VectorXd by_row = likelihoods * shares;
    const VectorXd gain = likelihoods.transpose() * by_row.cwiseInverse() / static_cast<double>(likelihoods.rows());
    shares = shares.cwiseProduct(gain);
  }
  return shares;
}

}  // namespace

Magnitudes expected_magnitudes(const std::vector<Vec2>& forces_nN, const MatrixXd& covariance) {
  const auto n = std::ssize(forces_nN);
  double least_error = std::sqrt(covariance.diagonal().minCoeff()), largest = least_error;
  for (const Vec2 f : forces_nN) largest = std::max(largest, norm(f));
  const std::vector<double> deviations = deviations_for(least_error, largest);
  const auto block = [&](Index a, Index b) -> Matrix2d { return covariance.block<2, 2>(2 * a, 2 * b); };
  MatrixXd likelihoods(n, std::ssize(deviations));
  for (Index a = 0; a < n; ++a) {
    const Vector2d found(forces_nN[a].x, forces_nN[a].y);
    VectorXd logarithms(likelihoods.cols());
    for (Index k = 0; k < likelihoods.cols(); ++k) {
      const Matrix2d spread = block(a, a) + deviations[k] * deviations[k] * Matrix2d::Identity();
      logarithms[k] = -0.5 * (found.dot(spread.inverse() * found) + std::log(spread.determinant()));
    }
    likelihoods.row(a) = (logarithms.array() - logarithms.maxCoeff()).exp();
  }
  const VectorXd shares = likeliest_shares(likelihoods);
  Magnitudes magnitudes{VectorXd::Zero(n), MatrixXd(n, n)};
  VectorXd deviation(n), error_along(n);
  MatrixXd along(2, n);
  for (Index a = 0; a < n; ++a) {
    const Vector2d found(forces_nN[a].x, forces_nN[a].y);
    const VectorXd weights = likelihoods.row(a).transpose().cwiseProduct(shares).normalized();
    double squared = 0;
    for (Index k = 0; k < weights.size(); ++k) {
      const double s2 = deviations[k] * deviations[k], weight = weights[k] / weights.sum();
      const Matrix2d kept = s2 * (block(a, a) + s2 * Matrix2d::Identity()).inverse();
      const double mean2 = (kept * found).squaredNorm(), spread = (kept * block(a, a)).trace();
      magnitudes.expected_nN[a] += weight * mean_length(mean2, 0.5 * spread);
      squared += weight * (mean2 + spread);
    }
    deviation[a] = std::sqrt(std::max(0.0, squared - std::pow(magnitudes.expected_nN[a], 2)));
    along.col(a) = inverse::direction_of(found);
    error_along[a] = inverse::error_along(found, block(a, a));
  }
  // errors of different forces go together as those found along them do
  for (Index a = 0; a < n; ++a)
    for (Index b = 0; b < n; ++b)
      magnitudes.covariance_nN2(a, b) = deviation[a] * deviation[b] * along.col(a).dot(block(a, b) * along.col(b)) /
                                        (error_along[a] * error_along[b]);
  return magnitudes;
}

}  // namespace mbtfm::tractions
