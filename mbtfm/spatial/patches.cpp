/// A force on each adhesion, spread evenly over its part of the surface, and a weak background everywhere else.
/// docs/theory/tractions-in-space.md.
#include <algorithm>
#include <cmath>

#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

namespace {

/// By adhesion: the tractions at the vertices that represent a force of one on it; in the answer of the beads it is the
/// ellipse itself.
MatrixXd shapes_of(const Problem& problem, const MatrixXd& areas_um2) {
  const Eigen::Map<const VectorXd> areas(problem.mesh.areas_um2.data(), problem.mesh.n_vertices());
  MatrixXd shapes = MatrixXd::Zero(areas.size(), areas_um2.rows());
  for (Index a = 0; a < areas_um2.rows(); ++a)
    shapes.col(a) = areas_um2.row(a).transpose().cwiseQuotient(areas) / areas_um2.row(a).sum();
  return shapes;
}

/// Tractions that may be anywhere.
struct Anywhere {
  Basis basis;
  MatrixXd response;
};
Anywhere tractions_anywhere(const Problem& problem, int threads) {
  Basis basis = orthonormal_basis(norm_of(problem.mesh, problem.ground, [](Vec2) { return 1.0; }));
  MatrixXd response = basis.response(problem.response_um_per_kPa, threads);
  return {std::move(basis), std::move(response)};
}

/// How far what the patches leave looks like tractions besides them, as a standard normal deviate. With y the rows
/// less their best forces on the patches, A the response to tractions of variance one anywhere and M the projection off
/// the patches' response, y'A A'y is the score of these tractions' variance at zero. Over y'y per datum, if patches are
/// all there is, it has the first two moments of a scaled chi-squared of h = (tr K)²/tr K² with K = A'M A, which the
/// cube root makes normal (Wilson & Hilferty, PNAS 17 (1931) 684). Taken off before is what a field of the size of the
/// gel's model error adds on the average, if tractions of variance one made it: that error is no noise.
/// Source: Lin, Biometrika 84 (1997) 309.
/// @param beside  the rows, with the patches as one more block  @param degrees  of freedom that y has
double deviate_of_tractions_beside(const Problem& problem, const inverse::Rows& beside, const MatrixXd& anywhere,
                                   const VectorXd& weights_by_row, double degrees, int threads) {
  const VectorXd u = rows_of(problem, weights_by_row).of(problem.displacement_um());
  const MatrixXd y = beside.of(problem.displacement_um()), MA = beside.of(anywhere), K = numerics::gram(MA, threads);
  const double trace = K.trace(), trace_of_square = K.squaredNorm();
  const double of_gel = std::pow(problem.model_error, 2) * u.squaredNorm() * trace_of_square / trace;
  const double score = std::max(0.0, numerics::small_transposed_product(MA, y).squaredNorm() - of_gel);
  const double h = trace * trace / trace_of_square;
  const double over_expected = score / (y.squaredNorm() / degrees) / trace;
  const double spread = 2 / (9 * h);
  return (std::cbrt(over_expected) - (1 - spread)) / std::sqrt(spread);
}

}  // namespace

SpatialReconstruction reconstruct_patches(const Problem& problem, const tractions::TractionParameters& traction,
                                          const SpatialParameters& parameters, int threads) {
  SpatialReconstruction r;
  const Index n_patches = problem.adhesion_areas_um2.rows();
  const MatrixXd& G = problem.patch_response_um_per_nN;
  MatrixXd of_patches(G.rows(), G.cols());  // by component
  for (Index a = 0; a < n_patches; ++a) {
    for (Index c = 0; c < 3; ++c) of_patches.col(c * n_patches + a) = G.col(3 * a + c);
  }
  // |x|² is the integral of the squares of an even traction, too
  const VectorXd scales = problem.adhesion_areas_um2.rowwise().sum().cwiseSqrt();
  const MatrixXd patch_shapes = shapes_of(problem, problem.adhesion_areas_um2) * scales.asDiagonal();
  of_patches = of_patches * scales.replicate(3, 1).asDiagonal();
  const bool has_background = parameters.background > 0;
  MatrixXd shapes = patch_shapes, response = of_patches, of_background(G.rows(), 0);
  if (has_background) {
    const double weak = parameters.background;
    const Basis background = orthonormal_basis(norm_of(problem.mesh, problem.ground, [weak](Vec2) { return weak; }));
    of_background = background.response(problem.response_um_per_kPa, threads);
    const Index n = background.size(), m = n + n_patches;
    shapes.resize(patch_shapes.rows(), m);
    shapes << background.shapes(), patch_shapes;
    response.resize(G.rows(), 3 * m);
    for (Index c = 0; c < 3; ++c) {
      response.middleCols(c * m, n) = of_background.middleCols(c * n, n);
      response.middleCols(c * m + n, n_patches) = of_patches.middleCols(c * n_patches, n_patches);
    }
  }
  tractions::TractionParameters penalised = traction;
  if (!has_background && !traction.lambda_um_per_kPa) {
    // Few numbers that the beads determine well: least squares. Criteria of lambda take the half of them that is felt
    // least for noise, with whatever pulls there.
    constexpr double kNone = 1e-6;
    const VectorXd even = VectorXd::Ones(response.rows());
    const auto spectrum = spectrum_of(problem, response, even, static_cast<double>(response.rows()), threads);
    penalised.lambda_um_per_kPa = kNone * std::sqrt(spectrum.values().maxCoeff()) / lambda_per_um_per_kPa(problem);
  }
  r = reconstruct_in(Basis(std::move(shapes)), response, problem, penalised, parameters, threads);
  if (r.covariance_kPa2.size() == 0) return r;  // nothing has moved
  const inverse::Rows beside = rows_of(problem, r.weighing.by_row, of_patches);
  const auto degrees = [&](Index n_fitted) { return std::max(1.0, r.weighing.n_data - static_cast<double>(n_fitted)); };
  const double alone = beside.of(problem.displacement_um()).squaredNorm() / degrees(of_patches.cols());
  if (!has_background && !weighs_by_residual(parameters.loss)) {
    const double variance = std::max(alone, problem.least_variance());
    r.covariance_kPa2 *= variance / r.variance;
    r.variance = variance;
  }
  r.forces = forces_beside_background(problem, of_background, r, threads);
  if (!has_background && !traction.lambda_um_per_kPa) {
    r.lambda.reset();
    r.length_um.reset();
    r.scan.reset();
  }
  const Anywhere anywhere = tractions_anywhere(problem, threads);
  const double noise =
      has_background
          ? r.variance
          : reconstruct_in(anywhere.basis, anywhere.response, problem, traction, parameters, threads).variance;
  const double deviate = deviate_of_tractions_beside(problem, beside, anywhere.response, r.weighing.by_row,
                                                     degrees(beside.n_beside()), threads);
  r.figures.emplace_back("misfit_of_patches_alone", alone / noise);
  r.figures.emplace_back("tractions_beside_patches", deviate);
  r.findings.push_back(noticed(Symptom::patches_do_not_fit, deviate));
  return r;
}

}  // namespace mbtfm::spatial
