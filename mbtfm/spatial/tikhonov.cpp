#include <algorithm>
#include <cmath>

#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/tractions/recurrences.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct Fit {
  std::optional<tractions::Spectrum> spectrum;
  tractions::LambdaScan scan;
  double lambda = 0;
  double over_judged = 1;  ///< variance as weighed over that of the scan
  VectorXd x;
  Weighing weighing;
};

}  // namespace

double lambda_per_um_per_kPa(const Problem& problem) {
  const double area = [&] {
    double sum = 0;
    for (const double a : problem.mesh.areas_um2) sum += a;
    return sum;
  }();
  const auto n = static_cast<double>(problem.observed.n_beads);
  return std::sqrt(n / area * problem.observed.sigma_um.cwiseAbs2().cwiseInverse().mean());
}

double lambda_by(const tractions::LambdaScan& scan, tractions::LambdaCriterion criterion) {
  const double lambda = chosen_lambda(scan, criterion);
  return criterion == tractions::LambdaCriterion::risk ? std::max(lambda, scan.by_evidence) : lambda;
}

SpatialReconstruction reconstruct_in(const Basis& basis, const MatrixXd& response, const Problem& problem,
                                     const tractions::TractionParameters& traction, const SpatialParameters& parameters,
                                     int threads) {
  SpatialReconstruction r;
  const Observed& observed = problem.observed;
  // of a datum as weighed
  const auto least_variance = [&](const Weighing& weighing) {
    const double of_unit = std::max(observed.states_errors ? 1.0 : 0.0, problem.variance_of_model());
    const double least = of_unit * weighing.per_square;
    return parameters.loss == BeadLoss::l2 ? least : std::max(least, weighing.variance);
  };
  const auto scanned = [&](const tractions::Spectrum& spectrum, const Weighing& weighing) {
    const double least = least_variance(weighing);
    return spectrum.scan(least > 0 ? std::optional(least) : std::nullopt, tractions::Recurrences::kLeastFelt);
  };
  // The tractions of the weighed beads with the lambda of their own noise, or with that of `judged`: beads far astray
  // that keep some weight would be followed by ever smaller lambdas, so that lambda is chosen without them. Of both,
  // variance / lambda² is what tractions are expected to be.
  const auto fit = [&](Weighing weighing, const std::optional<Weighing>& judged = {}) {
    Fit made;
    made.spectrum.emplace(spectrum_of(problem, response, weighing.by_row, weighing.n_data, threads));
    made.scan = judged ? scanned(spectrum_of(problem, response, judged->by_row, judged->n_data, threads), *judged)
                       : scanned(*made.spectrum, weighing);
    made.over_judged = judged ? least_variance(weighing) / least_variance(*judged) : 1;
    made.lambda = traction.lambda_um_per_kPa ? *traction.lambda_um_per_kPa * lambda_per_um_per_kPa(problem)
                                             : lambda_by(made.scan, traction.lambda_by) * std::sqrt(made.over_judged);
    made.x = made.spectrum->solve(made.lambda);
    made.weighing = std::move(weighing);
    return made;
  };
  const VectorXd displacement_um = problem.displacement_um();
  const VectorXd of_nothing = displacement_um.cwiseQuotient(observed.sigma_um);
  const auto residual = [&](const VectorXd& x) -> VectorXd {
    return (displacement_um - response * x).cwiseQuotient(observed.sigma_um);
  };
  if (displacement_um.isZero(0)) {
    r.traction_kPa = VectorXd::Zero(problem.n_unknowns());
    r.resolved = VectorXd::Zero(problem.mesh.n_vertices());
    r.remark = "no bead has moved: there is no traction";
    return r;
  }
  Fit last = fit(weigh(BeadLoss::l2, observed, of_nothing, 0));
  if (parameters.loss != BeadLoss::l2) {
    // From tractions that no bead has pulled on: biweight has several minima, and beads far off hide in those of l2.
    constexpr int kMostRounds = 12;
    constexpr double kSettled = 0.005;
    Weighing weighing =
        weigh(parameters.loss == BeadLoss::biweight ? BeadLoss::huber : parameters.loss, observed, of_nothing, 0);
    std::optional<Weighing> judged;  // none before a residual is known
    double change = 1;
    for (int round = 0; round < kMostRounds && change > kSettled; ++round) {
      Fit next = fit(std::move(weighing), judged);
      change = (next.x - last.x).norm() / std::max(next.x.norm(), 1e-300);
      const VectorXd left = residual(next.x);
      const double degrees = next.spectrum->degrees(next.lambda);
      weighing = weigh(parameters.loss, observed, left, degrees);
      if (parameters.loss != BeadLoss::biweight) judged = weigh(BeadLoss::biweight, observed, left, degrees);
      last = std::move(next);
    }
  }
  r.degrees = last.spectrum->degrees(last.lambda);
  r.weighing = weigh(parameters.loss, observed, residual(last.x), r.degrees);
  r.variance = std::max(last.over_judged * last.scan.variance, least_variance(last.weighing));
  r.traction_kPa = basis.tractions(last.x);
  r.covariance_kPa2 = basis.covariance(last.spectrum->posterior(last.lambda, r.variance), threads);
  // Lambda by the risk may be larger than what tractions of the size that the evidence has call for: then more is
  // smoothed away than they are expected to be.
  const double by_evidence = last.scan.by_evidence * std::sqrt(last.over_judged);
  if (by_evidence < last.lambda) {
    const double more_kPa2 = r.variance * (std::pow(by_evidence, -2) - std::pow(last.lambda, -2));
    r.oversmoothed_kPa2 = basis.covariance(more_kPa2 * last.spectrum->taken_away(last.lambda), threads);
  }
  r.scan = std::move(last.scan);
  r.lambda = last.lambda;
  r.length_um = last.lambda / lambda_per_um_per_kPa(problem) * problem.gel.youngs_modulus_kPa;
  r.relative_l2 = last.spectrum->relative_l2(last.lambda);
  return r;
}

SpatialReconstruction reconstruct_tikhonov(const Problem& problem, const tractions::TractionParameters& traction,
                                           const SpatialParameters& parameters, int threads) {
  if (problem.map) return reconstruct_large(problem, traction, parameters);
  const MatrixXd norm = norm_of(problem.mesh, problem.ground, [&](Vec2 p) { return problem.expected.amplitude(p); });
  const Basis basis = orthonormal_basis(norm);
  const MatrixXd response = basis.response(problem.response_um_per_kPa, threads);
  SpatialReconstruction r = reconstruct_in(basis, response, problem, traction, parameters, threads);
  if (r.lambda && problem.patch_response_um_per_nN.size() > 0)
    r.forces = forces_beside_background(problem, response, r, threads);
  if (r.lambda) r.resolved = resolved_shares(r.covariance_kPa2, *r.lambda * *r.lambda / r.variance * norm);
  if (r.oversmoothed_kPa2.size() > 0) r.covariance_kPa2 += r.oversmoothed_kPa2;
  return r;
}

}  // namespace mbtfm::spatial
