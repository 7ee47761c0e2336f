/// Tractions that are zero in most places: a sum of smooth spots, least squares with the sum of the spots' forces as
/// penalty. docs/theory/tractions-in-space.md (28) and (29).
#include <algorithm>
#include <cmath>

#include "mbtfm/spatial/basis.h"
#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/rows.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

using Eigen::ArrayXd;

namespace {

/// By place: the length of its three components, which lie n apart.
ArrayXd lengths_of(const VectorXd& x) {
  const Index n = x.size() / 3;
  return (x.head(n).array().square() + x.segment(n, n).array().square() + x.tail(n).array().square()).sqrt();
}

VectorXd for_each_component(const VectorXd& by_place) { return by_place.replicate(3, 1); }

/// Minimises ½ |A x − u|² + mu Σ w |x_i| over vectors x_i, for several mu in turn, by alternating directions (Boyd et
/// al., Found. Trends Mach. Learn. 3 (2011) 1, section 6.4), in the frame of AᵀA, so that no step factorises anything.
class GroupLasso {
 public:
  /// @param largest  about the largest |x_i|: tells the size of a good step, no more
  GroupLasso(const MatrixXd& normal, VectorXd pulled, double data_squared, ArrayXd weights, double largest)
      : normal_(normal),
        pulled_(std::move(pulled)),
        data_squared_(data_squared),
        weights_(std::move(weights)),
        largest_(largest) {
    auto [values, vectors] = numerics::symmetric_eigen(normal);
    values_ = values.array().max(0);
    vectors_ = std::move(vectors);
    projected_ = numerics::transposed_matvec(vectors_, pulled_);
    z_ = VectorXd::Zero(pulled_.size());
    dual_ = z_;
  }

  /// From which on nothing is left.
  double largest_mu() const { return (lengths_of(pulled_) / weights_).maxCoeff(); }

  void minimise(double mu) {
    constexpr double kSettled = 1e-3;  // of x: below what the noise makes of it
    constexpr int kMost = 600;
    // about where shortening is a tenth of the largest vectors, as mbtfm/tractions/sparse.cpp has it
    constexpr double kShortening = 0.1;
    const double rho = mu * weights_.mean() / (kShortening * largest_);
    VectorXd x;
    for (int k = 0; k < kMost; ++k) {
      const VectorXd right = projected_ + numerics::transposed_matvec(vectors_, rho * z_ - dual_);
      x = numerics::matvec(vectors_, (right.array() / (values_ + rho)).matrix());
      const VectorXd v = x + dual_ / rho;
      const ArrayXd shares = (1 - mu / rho * weights_ / lengths_of(v).max(1e-300)).max(0);
      const VectorXd next = v.cwiseProduct(for_each_component(shares.matrix()));
      const double size = std::max(next.norm(), 1e-300);
      const double change = (next - z_).norm() / size, gap = (x - next).norm() / size;
      z_ = next;
      dual_ += rho * (x - z_);
      ++steps_;
      if (std::max(change, gap) < kSettled) return;
    }
  }

  const VectorXd& x() const { return z_; }
  double misfit() const { return data_squared_ - 2 * z_.dot(pulled_) + numerics::quadratic_form(normal_, z_); }
  int steps() const { return steps_; }
  const VectorXd& pulled() const { return pulled_; }
  const ArrayXd& weights() const { return weights_; }

 private:
  const MatrixXd& normal_;
  VectorXd pulled_;
  double data_squared_;
  ArrayXd weights_, values_;
  MatrixXd vectors_;
  VectorXd projected_, z_, dual_;
  double largest_;
  int steps_ = 0;
};

/// The penalty at which the misfit is what noise leaves (Morozov's discrepancy): from where nothing is left, down.
/// @param target  the misfit aimed at
double choose_mu(GroupLasso& lasso, double target) {
  constexpr double kStep = 0.63, kSmallest = 1e-4;
  const double largest = lasso.largest_mu();
  double mu = 0.25 * largest, misfit_before = 0, mu_before = 0;
  for (; mu > kSmallest * largest; mu *= kStep) {
    lasso.minimise(mu);
    const double misfit = lasso.misfit();
    if (misfit <= target) break;
    misfit_before = misfit;
    mu_before = mu;
  }
  if (mu_before > 0 && mu > kSmallest * largest) {  // between the two, where it is met
    const double share = std::clamp((misfit_before - target) / (misfit_before - lasso.misfit()), 0.0, 1.0);
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

Posterior posterior_of(const GroupLasso& lasso, const MatrixXd& normal, double mu, double variance, int threads) {
  constexpr int kRounds = 4;
  const Index n = lasso.weights().size();
  Posterior posterior{lasso.x(), {}, {}};
  ArrayXd spread = ArrayXd::Constant(n, lengths_of(lasso.x()).square().mean());
  for (int round = 0; round < kRounds; ++round) {
    const ArrayXd size = (lengths_of(posterior.mean).square() + spread).sqrt();
    posterior.precision_before = for_each_component((mu * lasso.weights() / size).matrix());
    posterior.covariance = inverse_of(normal, posterior.precision_before, threads);
    posterior.mean = numerics::matvec(posterior.covariance, lasso.pulled());
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
  const Rows rows(problem, r.weighing.by_row);  // Tikhonov's weights
  const MatrixXd weighed = rows.of(response);
  const VectorXd data = rows.of(problem.displacement_um());
  const MatrixXd normal = numerics::gram(weighed, threads);
  GroupLasso lasso(normal, numerics::transposed_matvec(weighed, data), data.squaredNorm(), weights, largest);
  // The sum of n squares of the noise varies by sqrt(2/n), 2 % for 1 500 beads, and that is half of what the penalty
  // moves: the misfit aimed at is the one of the noise that these beads have, not of the one they state, and of what
  // their weights leave of it.
  const double aimed = std::max(r.variance_left, problem.variance_of_model());
  const double mu = choose_mu(lasso, aimed * r.weighing.n_data);
  const VectorXd at_minimum = lasso.x();
  r.traction_kPa = basis.tractions(at_minimum);
  r.relative_l2 = std::sqrt(std::max(0.0, lasso.misfit()) / std::max(data.squaredNorm(), 1e-300));
  const Posterior posterior = posterior_of(lasso, normal, mu, variance, threads);
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
               {"n_steps", std::int64_t{lasso.steps()}}};
  return r;
}

}  // namespace mbtfm::spatial
