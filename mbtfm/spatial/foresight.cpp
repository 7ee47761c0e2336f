#include "mbtfm/spatial/foresight.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

using Eigen::ArrayXd;

namespace {

/// Lᵀ S of the sums S over the surface of each component of the tractions.
MatrixXd sums_of(const Problem& problem, const Basis& basis) {
  MatrixXd sums(3 * basis.size(), 3);
  for (Index c = 0; c < 3; ++c) {
    VectorXd areas = VectorXd::Zero(problem.n_unknowns());
    for (Index v = 0; v < problem.mesh.n_vertices(); ++v) areas[3 * v + c] = problem.mesh.areas_um2[v];
    sums.col(c) = basis.transposed(areas);
  }
  return sums;
}

/// The diagonal of L X L⁻¹ for X = V diag Vᵀ, mean over the components: resolved_shares() has I − C Q with Q the
/// inverse of L Lᵀ but for a factor. By vertex and direction V.
MatrixXd shown_by(const Basis& basis, const MatrixXd& norm, const MatrixXd& vectors) {
  const Index n = basis.size();
  const MatrixXd dual = norm * basis.shapes();  // L⁻ᵀ
  MatrixXd shown = MatrixXd::Zero(n, vectors.cols());
  for (Index c = 0; c < 3; ++c) {
    const MatrixXd of_component = vectors.middleRows(c * n, n);
    shown += (numerics::product(basis.shapes(), of_component).array() * numerics::product(dual, of_component).array())
                 .matrix() /
             3;
  }
  return shown;
}

}  // namespace

Foresight::Foresight(const Problem& problem, const tractions::TractionParameters& traction, int threads)
    : problem_(problem), traction_(traction) {
  if (problem.map)
    throw UsageError("up to " + std::to_string(kMostVertices) + " vertices of tractions have standard errors, and " +
                     std::to_string(problem.mesh.n_vertices()) + " are asked for: choose a wider traction.spacing_um");
  MBTFM_ASSERT(problem.patch_response_um_per_nN.size() > 0);
  const VectorXd displacement_um = problem.displacement_um();
  if (displacement_um.isZero(0)) throw UsageError("the known tractions move no bead");
  const MatrixXd norm = problem.norm_um2();
  const Basis basis = orthonormal_basis(norm);
  const inverse::Rows rows = rows_of(problem, VectorXd::Ones(displacement_um.size()));
  const MatrixXd A = rows.of(basis.response(problem.response_um_per_kPa, threads)),
                 P = rows.of(problem.patch_response_um_per_nN);
  const VectorXd u = rows.of(displacement_um);
  spectrum_.emplace(inverse::spectrum_of(A, u, static_cast<double>(u.size() - rows.n_beside()), threads));
  const MatrixXd& V = spectrum_->vectors();
  patches_ = numerics::gram(P, threads);
  hidden_ = numerics::small_transposed_product(V, numerics::small_transposed_product(A, P));
  pulled_by_patches_ = numerics::transposed_matvec(P, u);
  pulled_ = numerics::transposed_matvec(V, numerics::transposed_matvec(A, u));
  sums_ = numerics::small_transposed_product(V, sums_of(problem, basis));
  shown_ = shown_by(basis, norm, V);
}

Foreseen Foresight::at(double noise) const {
  const double stated = noise * noise;
  const double least = std::max(problem_.observed.states_errors ? stated : 0.0, problem_.variance_of_model());
  const inverse::Spectrum noisy = spectrum_->with_noise(stated);
  const inverse::LambdaScan scan =
      noisy.scan(std::max(least, noisy.variance_felt_least().value_or(0)), inverse::SignalIn::resolved);
  const ChosenLambda chosen = choose_lambda(problem_, scan, traction_, RiskCriterion::usable);
  const double variance = std::max(scan.variance, least), lambda2 = chosen.lambda * chosen.lambda;
  const ArrayXd& values = spectrum_->values();
  const ArrayXd of_background = 1 / (values + lambda2);
  const numerics::SmallCholesky information(
      numerics::minus_product(patches_, hidden_.transpose() * of_background.matrix().asDiagonal(), hidden_));
  const MatrixXd heard = numerics::minus_product(
      patches_, hidden_.transpose() * (2 * of_background - values * of_background.square()).matrix().asDiagonal(),
      hidden_);
  const MatrixXd inverse = information.inverse();
  Foreseen f{.lambda = chosen.lambda / noise,
             .degrees = noisy.degrees(chosen.lambda),
             .covariance_nN2 = variance * inverse,
             .by_noise_nN2 = numerics::small_product(numerics::small_product(stated, inverse, heard), inverse),
             .mean_nN = information.solve(
                 pulled_by_patches_ - numerics::transposed_matvec(hidden_, (of_background * pulled_.array()).matrix())),
             .net_force_nN2 = {},
             .net_by_noise_nN2 = {},
             .resolution_um = {}};
  const double of_sums = chosen.by == inverse::LambdaCriterion::risk ? scan.by_prediction : chosen.lambda;
  const ArrayXd of_sum = 1 / (values + of_sums * of_sums);
  f.net_force_nN2 = numerics::small_product(variance * sums_.transpose() * of_sum.matrix().asDiagonal(), sums_);
  f.net_by_noise_nN2 =
      numerics::small_product(stated * sums_.transpose() * (values * of_sum.square()).matrix().asDiagonal(), sums_);
  SpatialReconstruction as_resolved;
  as_resolved.resolved = numerics::matvec(shown_, (values * of_background).matrix()).cwiseMax(0).cwiseMin(1);
  f.resolution_um = resolution_um(problem_, as_resolved);
  return f;
}

}  // namespace mbtfm::spatial
