/// Tractions that are zero in most places: a sum of smooth spots, least squares with the sum of the spots' forces as
/// penalty. docs/theory/tractions-in-space.md (28) and (29).
#include <algorithm>
#include <cmath>

#include "mbtfm/inverse/group_lasso.h"
#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

using Eigen::ArrayXd;

namespace {

using inverse::GroupLasso;

ArrayXd lengths_of(const VectorXd& x) { return inverse::lengths_of(x, x.size() / 3); }

VectorXd for_each_component(const VectorXd& by_place) { return by_place.replicate(3, 1); }

/// The penalty at which the misfit is what noise leaves (Morozov's discrepancy): from where nothing is left, down.
/// @param largest  from which on nothing is left
/// @param target   the misfit aimed at
double choose_mu(GroupLasso& lasso, const inverse::Spectrum& squares, double largest, double target) {
  constexpr double kStep = 0.63, kSmallest = 1e-4;
  double mu = 0.25 * largest, misfit_before = 0, mu_before = 0;
  for (; mu > kSmallest * largest; mu *= kStep) {
    lasso.minimise(mu);
    const double misfit = squares.misfit_of(lasso.x());
    if (misfit <= target) break;
    misfit_before = misfit;
    mu_before = mu;
  }
  if (mu_before > 0 && mu > kSmallest * largest) {  // between the two, where it is met
    const double share =
        std::clamp((misfit_before - target) / (misfit_before - squares.misfit_of(lasso.x())), 0.0, 1.0);
    mu = mu_before * std::pow(mu / mu_before, share);
    lasso.minimise(mu);
  }
  return mu;
}

/// (N + diag q)⁻¹
MatrixXd inverse_of(MatrixXd normal, const VectorXd& q, int threads) {
  normal.diagonal() += q;
  MatrixXd inverse = MatrixXd::Identity(normal.rows(), normal.cols());
  if (!numerics::upper_cholesky(normal, threads)) throw InternalError("a penalised matrix is not positive definite");
  numerics::solve_upper_transposed(normal, inverse, threads);
  return numerics::gram(inverse, threads);
}

/// What is known of x under the penalty: of |x_i| the quadratic function that touches it where the mean square of x_i
/// is, which makes a Gaussian of the rest (a variational bound; Palmer et al., Adv. Neural Inf. Process. Syst. 18
/// (2006) 1059). Its mean is not shortened as the minimum is.
struct Posterior {
  VectorXd mean, precision_before;  ///< by unknown, in units of the data's variance
  MatrixXd covariance;
};

/// @param normal, adjoint  AᵀA and Aᵀu
Posterior posterior_of(const VectorXd& at_minimum, const MatrixXd& normal, const VectorXd& adjoint,
                       const ArrayXd& penalty, double variance, int threads) {
  constexpr int kRounds = 4;
  const Index n = penalty.size();
  Posterior posterior{at_minimum, {}, {}};
  ArrayXd spread = ArrayXd::Constant(n, lengths_of(at_minimum).square().mean());
  for (int round = 0; round < kRounds; ++round) {
    const ArrayXd size = (lengths_of(posterior.mean).square() + spread).sqrt();
    posterior.precision_before = for_each_component((penalty / size).matrix());
    posterior.covariance = inverse_of(normal, posterior.precision_before, threads);
    posterior.mean = numerics::matvec(posterior.covariance, adjoint);
    const VectorXd diagonal = variance * posterior.covariance.diagonal();
    spread = diagonal.head(n) + diagonal.segment(n, n) + diagonal.tail(n);
  }
  posterior.covariance *= variance;
  return posterior;
}

}  // namespace

SpatialReconstruction reconstruct_group_l1(const Problem& problem, const tractions::TractionParameters& traction,
                                           const SpatialParameters& parameters, int threads) {
  SpatialReconstruction r = reconstruct_tikhonov(problem, traction, parameters, threads);
  if (!r.scan) return r;  // nothing has moved
  const Index n = problem.mesh.n_vertices();
  const double width_um = spot_width_um(problem.observed.distance_um);
  const Basis basis = spot_basis(problem.mesh, problem.ground, width_um);
  const MatrixXd response = basis.response(problem.response_um_per_kPa, threads);
  const Eigen::Map<const VectorXd> areas(problem.mesh.areas_um2.data(), n);
  // x is the root of the area times what was smoothed: Σ sqrt(area) |x| is the sum of the spots' forces
  ArrayXd weights = areas.array().sqrt();
  for (Index v = 0; v < n; ++v)
    weights[v] /= std::max(problem.expected.amplitude(problem.mesh.quads.points_um[v]), 1e-3);

  double largest = 0;
  for (Index v = 0; v < n; ++v)
    largest = std::max(largest, std::sqrt(areas[v]) * r.traction_kPa.segment<3>(3 * v).norm());
  const double variance = r.variance;
  const inverse::Rows rows = rows_of(problem, r.weighing.by_row);  // Tikhonov's weights
  const MatrixXd weighed = rows.of(response), normal = numerics::gram(weighed, threads);
  const VectorXd data = rows.of(problem.displacement_um()), adjoint = numerics::transposed_matvec(weighed, data);
  const inverse::Spectrum squares(normal, adjoint, data.squaredNorm(), r.weighing.n_data);
  constexpr inverse::Settled kSettled{.change = 1e-3, .gap = 1e-3, .most_steps = 600};  // below what noise makes of x
  const auto solve = [&](const VectorXd& added, double rho) { return squares.solve(std::sqrt(rho), added); };
  GroupLasso lasso(solve, 3 * n, weights, largest, kSettled);
  // The sum of n squares of the noise varies by sqrt(2/n), 2 % for 1 500 beads, and that is half of what the penalty
  // moves: the misfit aimed at is the one of the noise that these beads have, not of the one they state, and of what
  // their weights leave of it.
  const double aimed = std::max(r.variance_left, problem.variance_of_model());
  const double mu = choose_mu(lasso, squares, (lengths_of(adjoint) / weights).maxCoeff(), aimed * r.weighing.n_data);
  const VectorXd& at_minimum = lasso.x();
  r.traction_kPa = basis.tractions(at_minimum);
  r.relative_l2 = std::sqrt(std::max(0.0, squares.misfit_of(lasso.x())) / std::max(data.squaredNorm(), 1e-300));
  const Posterior posterior = posterior_of(at_minimum, normal, adjoint, mu * weights, variance, threads);
  r.covariance_kPa2 = basis.covariance(posterior.covariance, threads);
  r.summands = Summands{basis.tractions(posterior.mean), r.covariance_kPa2, {}};
  const VectorXd seen =
      VectorXd::Ones(3 * n) - posterior.covariance.diagonal().cwiseProduct(posterior.precision_before) / variance;
  r.resolved = (seen.head(n) + seen.segment(n, n) + seen.tail(n)) / 3;
  r.degrees = seen.sum();
  r.lambda.reset();
  r.lambda_by.reset();
  r.findings.clear();  // of that lambda
  r.length_um.reset();
  r.scan.reset();
  r.figures = {{"penalty_per_nN", mu},
               {"spot_width_um", width_um},
               {"n_active_spots", static_cast<std::int64_t>((lengths_of(at_minimum) > 0).count())},
               {"n_steps", std::int64_t{lasso.n_steps()}}};
  return r;
}

}  // namespace mbtfm::spatial
