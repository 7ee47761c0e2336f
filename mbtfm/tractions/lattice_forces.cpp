#include <cmath>
#include <limits>

#include "mbtfm/tractions/beside_background.h"
#include "mbtfm/tractions/fttc.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tractions {

namespace {

/// What is known of the forces for one m, with the s² that makes the data most likely.
struct Known {
  double log_likelihood = -std::numeric_limits<double>::infinity();  ///< of the forces' part
  VectorXd mean;
  MatrixXd covariance;
};

Known known_from(const BesideBackground::Normal& normal, double variance) {
  const auto [values, vectors] = numerics::symmetric_eigen(normal.matrix / variance);
  const double floor = 1e-9 * values.maxCoeff();  // rounding
  const Eigen::ArrayXd d = values.array().max(floor);
  const Eigen::ArrayXd y = (vectors.transpose() * normal.right).array() / variance;
  const auto log_likelihood = [&](double before) {
    return 0.5 * (y.square() * before / (1 + before * d)).sum() - 0.5 * (1 + before * d).log().sum();
  };
  // s² from what the best seen force is known to, down to nothing, and up to all of the largest
  const double least = 1e-3 / d.maxCoeff(), most = 10 * (y / d).square().maxCoeff();
  double best = least;
  Known known;
  for (double before = least; before < most; before *= 1.2) {
    const double value = log_likelihood(before);
    if (!(value > known.log_likelihood)) continue;
    known.log_likelihood = value;
    best = before;
  }
  const Eigen::ArrayXd after = (d + 1 / best).inverse();
  known.mean = vectors * (after * y).matrix();
  known.covariance = vectors * after.matrix().asDiagonal() * vectors.transpose();
  return known;
}

/// The logarithm of how likely the data are without forces, as (14), for a known variance; up to a constant.
std::vector<double> log_likelihoods_of(const LambdaScan& scan) {
  std::vector<double> values = log_determinants_of(scan.points);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const ScanPoint& p = scan.points[i];
    values[i] = -0.5 * (p.misfit + p.lambda * p.lambda * p.norm) / scan.variance - 0.5 * values[i];
  }
  return values;
}

/// From next to no background, which is quickly solved, to that of (9) by cross-validation, which explains the data
/// without any adhesion: until it gets less likely.
Known most_likely(const LatticeProblem& problem, const LambdaScan& scan, const MatrixXd& D, int threads) {
  const std::vector<double> without = log_likelihoods_of(scan);
  BesideBackground beside(problem, D, threads);
  Known best;
  double likeliest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const double m = scan.points[i].lambda;
    if (m < scan.by_gcv && i > 0) break;
    Known known = known_from(beside.at(m), scan.variance);
    const double value = without[i] + known.log_likelihood;
    if (value < likeliest) break;
    likeliest = value;
    best = std::move(known);
  }
  return best;
}

}  // namespace

std::vector<AdhesionForce> forces_beside(const LatticeProblem& problem, const LambdaScan& scan,
                                         const std::vector<GroundPatch>& patches, const TractionInputs& inputs,
                                         const TractionParameters& parameters, int threads) {
  std::vector<AdhesionForce> forces = forces_by_adhesion(patches, inputs.adhesions, parameters.grow_um);
  if (forces.empty()) return forces;
  const MatrixXd D = problem.weighted(even_forces_um_per_nN(inputs, parameters.gel_model, threads));
  const Known known = most_likely(problem, scan, D, threads);
  for (std::size_t a = 0; a < forces.size(); ++a) {
    const auto row = 2 * static_cast<Index>(a);
    forces[a].force_nN = {known.mean[row], known.mean[row + 1]};
    const Vec2 along = direction_of(forces[a].force_nN);
    const Eigen::Vector2d e(along.x, along.y);
    forces[a].sigma_nN = std::sqrt(e.dot(known.covariance.block<2, 2>(row, row) * e));
  }
  return forces;
}

}  // namespace mbtfm::tractions
