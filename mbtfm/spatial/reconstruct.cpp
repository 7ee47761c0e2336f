#include <algorithm>
#include <cmath>
#include <numeric>

#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "mbtfm/tractions/spectrum.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"
#include "substrate/response.h"

namespace mbtfm::spatial {

namespace {

using tractions::TractionMethod;

SpatialReconstruction by_method(TractionMethod method, const Problem& problem,
                                const tractions::TractionParameters& traction, const SpatialParameters& parameters,
                                int threads) {
  using By = decltype(&reconstruct_tikhonov);
  constexpr std::pair<TractionMethod, By> kMethods[] = {
      {TractionMethod::tikhonov, reconstruct_tikhonov}, {TractionMethod::group_l1, reconstruct_group_l1},
      {TractionMethod::patches, reconstruct_patches},   {TractionMethod::adjoint, reconstruct_adjoint},
      {TractionMethod::green, reconstruct_green},       {TractionMethod::thesis_cg, reconstruct_thesis_cg}};
  if (method == TractionMethod::direct) return reconstruct_direct(problem, threads);
  const auto by = std::ranges::find(kMethods, method, &std::pair<TractionMethod, By>::first);
  if (by == std::end(kMethods)) throw InternalError("a method of flat surfaces");
  return by->second(problem, traction, parameters, threads);
}

/// From the middle of what may carry tractions to the nearest bead.
double distance_to_beads_um(const Problem& problem) {
  const numerics::Near beads = near_beads(problem.observed);
  std::vector<double> distances;
  for (const Vec3& v : problem.vertices_um()) {
    if (!problem.expected.is_part({v.x, v.y})) continue;
    distances.push_back(norm(beads.points()[beads.nearest(v, 1).front()] - v));
  }
  return numerics::median(std::move(distances));
}

/// Share of the beads whose residuals noise does not have.
double share_astray(const Problem& problem, const VectorXd& residual) {
  constexpr double kFar = 5;  // of a component's standard deviation, as most beads have it
  const Index n = problem.observed.n_components();
  const double scale = weigh(BeadLoss::biweight, problem.observed, residual, 0).scale;
  int n_far = 0;
  for (Index b = 0; b < problem.observed.n_beads; ++b) n_far += residual.segment(n * b, n).norm() > kFar * scale;
  return scale > 0 ? static_cast<double>(n_far) / problem.observed.n_beads : 0;
}

/// Whether the answer is that of the beads, or of the loss.
std::optional<Finding> notice_loss(BeadLoss loss, const Balance& by_loss, const Balance& by_squares) {
  const double sigma = std::hypot(by_loss.total_force_sigma_nN, by_squares.total_force_sigma_nN);
  const double apart = std::abs(by_loss.total_force_nN - by_squares.total_force_nN);
  return noticed(Symptom::loss_decides, sigma > 0 ? apart / sigma : 0, {.at = name_of(loss)});
}

void find_doubts(const Problem& problem, const SpatialParameters& parameters, SpatialReconstruction& r) {
  const Observed& observed = problem.observed;
  const int n_off = observed.n_above + observed.n_below_base;
  r.findings.push_back(noticed(Symptom::beads_off_the_gel, static_cast<double>(n_off) / (n_off + observed.n_beads)));
  r.findings.push_back(noticed(Symptom::beads_far, distance_to_beads_um(problem) / observed.distance_um));
  const bool has_few_unknowns = r.method == TractionMethod::patches && parameters.background == 0;  // by choice
  if (r.degrees > 0 && !has_few_unknowns) {
    constexpr double kEnough = 24;  // as the table of findings has it
    // Ten times the noise tells 4.5 times fewer numbers, and noise falls as the root of the number of beads: they grow
    // about as its cube root. Measured (notes/tractions_in_space.md).
    const double ratio = kEnough / r.degrees;
    r.findings.push_back(
        noticed(Symptom::beads_tell_little, ratio,
                {.value = brief(r.degrees), .at = brief(std::ceil(observed.n_beads * std::pow(ratio, 3)))}));
  }
  if (r.chi_squared > 0) r.findings.push_back(noticed(Symptom::misfit_in_space, r.chi_squared));
  if (parameters.loss == BeadLoss::l2) {
    r.findings.push_back(
        noticed(Symptom::beads_stray, share_astray(problem, problem.residual(r.traction_kPa, r.weighing.by_row))));
  }
}

}  // namespace

tractions::TractionMethod checked_method(const tractions::TractionParameters& traction, const SpatialInputs& inputs) {
  using enum TractionMethod;
  const TractionMethod method = traction.method.value_or(inputs.adhesions.empty() ? tikhonov : group_l1);
  switch (method) {
    case fttc:
    case sparse:
    case trpf:
    case bem:
    case adhesion_forces:
      throw UsageError(std::string(name_of(method)) +
                       " takes beads that a flat surface moves along itself, and these are in space: choose tikhonov, "
                       "group-l1 or patches");
    case patches:
      if (inputs.adhesions.empty()) throw UsageError("patches: --adhesions is missing or holds none");
      return method;
    case group_l1:
      if (traction.lambda_um_per_kPa) {
        throw UsageError(
            "group-l1: lambda_um_per_kPa belongs to the other methods; this one has a penalty of its own, at which the "
            "misfit is what the noise leaves");
      }
      return method;
    default:
      return method;
  }
}

SpatialReconstruction reconstruct(const Problem& problem, const SpatialInputs& inputs,
                                  const tractions::TractionParameters& traction, const SpatialParameters& parameters,
                                  int threads) {
  const TractionMethod method = checked_method(traction, inputs);
  if (problem.map && method != TractionMethod::tikhonov) {
    throw UsageError(std::string(name_of(method)) + " takes up to " + std::to_string(kMostVertices) +
                     " vertices of tractions, not " + std::to_string(problem.mesh.n_vertices()) +
                     ": choose a wider traction.spacing_um, or tikhonov");
  }
  SpatialReconstruction r = by_method(method, problem, traction, parameters, threads);
  r.method = method;
  if (inputs.adhesions.empty()) r.forces.clear();
  if (!inputs.adhesions.empty() && r.forces.empty()) {
    r.forces =
        forces_on(problem, r, adhesion_areas_um2(problem.mesh, problem.ground, inputs.adhesions, traction.grow_um));
  }
  for (std::size_t a = 0; a < r.forces.size(); ++a) r.forces[a].adhesion_id = inputs.adhesions[a].adhesion_id;
  const Observed& observed = problem.observed;
  r.noise_um = r.weighing.scale *
               (observed.states_errors
                    ? numerics::median(std::vector<double>(observed.sigma_um.begin(), observed.sigma_um.end()))
                    : 1);
  if (observed.states_errors && r.degrees > 0) r.chi_squared = r.weighing.scale * r.weighing.scale;
  find_doubts(problem, parameters, r);
  if (parameters.loss != BeadLoss::l2 && r.covariance_kPa2.size() > 0) {
    SpatialParameters squares = parameters;
    squares.loss = BeadLoss::l2;
    tractions::TractionParameters by_the_same = traction;  // else the criteria of lambda are compared
    if (r.lambda_by) by_the_same.lambda_by = *r.lambda_by;
    const SpatialReconstruction by_squares = by_method(method, problem, by_the_same, squares, threads);
    r.findings.push_back(notice_loss(parameters.loss, balance_of(problem, r), balance_of(problem, by_squares)));
  }
  const double falls_by = -r.flipped_z_chi_squared.value_or(0);
  if (auto reversed = noticed(Symptom::z_reversed, falls_by)) {
    r.findings.push_back(std::move(reversed));
    r.remark = "the beads fit better with the opposite sign of uz_um: look at z_points";
  }
  return r;
}

namespace {

struct Fit {
  std::optional<tractions::Spectrum> spectrum;
  tractions::LambdaScan scan;
  ChosenLambda chosen;
  VectorXd x;
  Weighing weighing;
};

std::optional<double> largest(std::optional<double> a, std::optional<double> b) {
  return a && b ? std::max(a, b) : a ? a : b;
}

SpatialReconstruction reconstruction_of_nothing(const Problem& problem) {
  SpatialReconstruction r;
  r.traction_kPa = VectorXd::Zero(problem.n_unknowns());
  r.remark = "no bead has moved: there is no traction";
  return r;
}

/// P W S G L and its transpose, by solutions of the gel.
tractions::LinearMap map_of(const Problem& problem, const Basis& basis, const Rows& rows) {
  const Index n_points = problem.map->rows(), n = problem.observed.n_components();
  tractions::LinearMap map;
  map.n_data = problem.observed.displacement_um.size();
  map.n_unknowns = 3 * basis.size();
  map.forward = [&problem, &basis, &rows](const MatrixXd& x) -> MatrixXd {
    MatrixXd t(problem.n_unknowns(), x.cols());
    for (Index k = 0; k < x.cols(); ++k) t.col(k) = basis.tractions(x.col(k));
    return rows.of(problem.at_beads(problem.map->displace(t)));
  };
  map.transposed = [&problem, &basis, &rows, n_points, n](const MatrixXd& y) -> MatrixXd {
    const MatrixXd weighed = rows.transposed(y);
    MatrixXd at_points = MatrixXd::Zero(n_points, y.cols());
    for (Index b = 0; b < problem.observed.n_beads; ++b) at_points.middleRows(3 * b, n) = weighed.middleRows(n * b, n);
    const MatrixXd pulled = problem.map->pull_back(at_points);
    MatrixXd x(3 * basis.size(), y.cols());
    for (Index k = 0; k < y.cols(); ++k) x.col(k) = basis.transposed(pulled.col(k));
    return x;
  };
  return map;
}

}  // namespace

double lambda_per_um_per_kPa(const Problem& problem) {
  const double area = std::accumulate(problem.mesh.areas_um2.begin(), problem.mesh.areas_um2.end(), 0.0);
  const auto n = static_cast<double>(problem.observed.n_beads);
  return std::sqrt(n / area * problem.observed.sigma_um.cwiseAbs2().cwiseInverse().mean());
}

std::optional<double> stated_variance(const Problem& problem, BeadLoss loss, const Weighing& weighing) {
  const double least = problem.least_variance();
  if (weighs_by_residual(loss) && problem.observed.states_errors)
    return weighing.variance / (weighing.scale * weighing.scale) * least;
  return least > 0 ? std::optional(least) : std::nullopt;
}

ChosenLambda choose_lambda(const Problem& problem, const tractions::LambdaScan& scan,
                           const tractions::TractionParameters& traction, RiskIs risk_is) {
  using enum tractions::LambdaCriterion;
  const double unit = lambda_per_um_per_kPa(problem);
  if (traction.lambda_um_per_kPa) return {*traction.lambda_um_per_kPa * unit, {}, {}};
  const tractions::LambdaCriterion by =
      traction.lambda_by == risk && risk_is == RiskIs::unsound ? gcv : traction.lambda_by;
  if (by != risk) return {chosen_lambda(scan, by), by, {}};
  ChosenLambda chosen{scan.by_risk, by, {}};
  chosen.finding = noticed(Symptom::lambda_runs_away, scan.by_evidence / scan.by_risk);
  if (chosen.finding) {
    chosen.lambda = scan.by_evidence;
    chosen.by = evidence;
  }
  return chosen;
}

SpatialReconstruction reconstruct_in(const Basis& basis, const MatrixXd& response, const Problem& problem,
                                     const tractions::TractionParameters& traction, const SpatialParameters& parameters,
                                     int threads) {
  SpatialReconstruction r;
  const Observed& observed = problem.observed;
  const std::vector<double> good = probabilities_of_good(parameters.loss, observed);
  const RiskIs risk_is = weighs_by_residual(parameters.loss) ? RiskIs::unsound : RiskIs::sound;
  const auto scanned = [&](const tractions::Spectrum& spectrum, const Weighing& weighing) {
    return spectrum.scan(largest(stated_variance(problem, parameters.loss, weighing), spectrum.variance_felt_least()),
                         tractions::SignalIn::told);
  };
  // The tractions of the weighed beads with the lambda of their own noise, or with that of `judged`: beads far astray
  // that keep some weight would be followed by ever smaller lambdas, so that lambda is chosen without them.
  const auto fit = [&](Weighing weighing, const std::optional<Weighing>& judged = {}) {
    Fit made;
    made.spectrum.emplace(spectrum_of(problem, response, weighing.by_row, weighing.n_data, threads));
    made.scan = judged ? scanned(spectrum_of(problem, response, judged->by_row, judged->n_data, threads), *judged)
                       : scanned(*made.spectrum, weighing);
    made.chosen = choose_lambda(problem, made.scan, traction, risk_is);
    if (judged && made.chosen.by)
      made.chosen.lambda *= std::sqrt(weighing.variance / judged->variance);  // the same prior
    made.x = made.spectrum->solve(made.chosen.lambda);
    made.weighing = std::move(weighing);
    return made;
  };
  const VectorXd displacement_um = problem.displacement_um();
  const VectorXd of_nothing = displacement_um.cwiseQuotient(observed.sigma_um);
  const auto residual = [&](const Fit& made) {
    return problem.over_errors(displacement_um - response * made.x, made.weighing.by_row);
  };
  if (displacement_um.isZero(0)) {
    r = reconstruction_of_nothing(problem);
    r.resolved = VectorXd::Zero(problem.mesh.n_vertices());
    return r;
  }
  Fit last = fit(weigh(BeadLoss::l2, observed, of_nothing, 0));
  const auto settle = [&](BeadLoss loss) {
    constexpr int kMostRounds = 12;
    constexpr double kSettled = 0.005;
    double change = 1;
    for (int round = 0; round < kMostRounds && change > kSettled; ++round) {
      const VectorXd left = residual(last);
      const double degrees = last.spectrum->degrees(last.chosen.lambda);
      std::optional<Weighing> judged;
      if (weighs_by_residual(loss) && loss != BeadLoss::biweight)
        judged = weigh(BeadLoss::biweight, observed, left, degrees);
      Fit next = fit(weigh(loss, observed, left, degrees, good), judged);
      change = (next.x - last.x).norm() / std::max(next.x.norm(), 1e-300);
      last = std::move(next);
    }
  };
  // biweight has several minima: from huber's, the only one
  if (parameters.loss == BeadLoss::biweight) settle(BeadLoss::huber);
  if (parameters.loss != BeadLoss::l2) settle(parameters.loss);
  const double lambda = last.chosen.lambda;
  r.degrees = last.spectrum->degrees(lambda);
  r.weighing = weigh(parameters.loss, observed, residual(last), r.degrees, good);
  r.variance = std::max(weighs_by_residual(parameters.loss) ? r.weighing.variance : last.scan.variance,
                        problem.least_variance());
  const double loose = last.scan.by_gcv;
  const double n_data = last.weighing.n_data;  // less where weights are small; a tenth at least is left, as in `weigh`
  r.variance_left = last.spectrum->misfit(loose) / std::max(n_data - last.spectrum->degrees(loose), 0.1 * n_data);
  r.traction_kPa = basis.tractions(last.x);
  r.covariance_kPa2 = basis.covariance(last.spectrum->posterior(lambda, r.variance), threads);
  if (last.chosen.by == tractions::LambdaCriterion::risk) {
    const double of_sums = last.scan.by_prediction;
    r.summands = Summands{basis.tractions(last.spectrum->solve(of_sums)),
                          basis.covariance(last.spectrum->posterior(of_sums, r.variance), threads), of_sums};
  }
  r.scan = std::move(last.scan);
  r.lambda = lambda;
  r.lambda_by = last.chosen.by;
  r.findings.push_back(std::move(last.chosen.finding));
  r.length_um = lambda / lambda_per_um_per_kPa(problem) * problem.gel.youngs_modulus_kPa;
  r.relative_l2 = last.spectrum->relative_l2(lambda);
  return r;
}

namespace {

/// The same where the problem has no matrix. No standard errors.
SpatialReconstruction reconstruct_large(const Problem& problem, const tractions::TractionParameters& traction,
                                        const SpatialParameters& parameters) {
  const Observed& observed = problem.observed;
  const Basis basis = orthonormal_basis(problem.norm_um2());
  if (observed.displacement_um.isZero(0)) return reconstruction_of_nothing(problem);
  SpatialReconstruction r;
  // as reconstruct_in() has it: from least squares, and to biweight by way of huber
  const std::vector<double> good = probabilities_of_good(parameters.loss, observed);
  const int n_rounds = parameters.loss == BeadLoss::l2 ? 1 : good.empty() ? 5 : 2;
  r.weighing = weigh(BeadLoss::l2, observed, observed.displacement_um.cwiseQuotient(observed.sigma_um), 0);
  for (int round = 0; round < n_rounds; ++round) {
    const Rows rows(problem, r.weighing.by_row);
    const tractions::Recurrences recurrences(map_of(problem, basis, rows), rows.of(observed.displacement_um), {});
    r.scan = recurrences.scan(stated_variance(problem, parameters.loss, r.weighing));
    const ChosenLambda chosen = choose_lambda(problem, *r.scan, traction, RiskIs::unsound);
    r.lambda = chosen.lambda;
    r.lambda_by = chosen.by;
    r.findings = {chosen.finding};
    r.traction_kPa = basis.tractions(recurrences.solve(*r.lambda));
    r.degrees = recurrences.degrees(*r.lambda);
    r.relative_l2 = recurrences.relative_l2(*r.lambda);
    const bool is_on_its_way = parameters.loss == BeadLoss::biweight && round < 2;
    r.weighing = weigh(is_on_its_way ? BeadLoss::huber : parameters.loss, observed,
                       problem.residual(r.traction_kPa, r.weighing.by_row), r.degrees, good);
  }
  r.variance =
      std::max(weighs_by_residual(parameters.loss) ? r.weighing.variance : r.scan->variance, problem.least_variance());
  r.length_um = *r.lambda / lambda_per_um_per_kPa(problem) * problem.gel.youngs_modulus_kPa;
  r.remark = "standard errors are computed of up to " + std::to_string(kMostVertices) + " vertices, and there are " +
             std::to_string(problem.mesh.n_vertices());
  return r;
}

}  // namespace

SpatialReconstruction reconstruct_tikhonov(const Problem& problem, const tractions::TractionParameters& traction,
                                           const SpatialParameters& parameters, int threads) {
  if (problem.map) return reconstruct_large(problem, traction, parameters);
  const MatrixXd norm = problem.norm_um2();
  const Basis basis = orthonormal_basis(norm);
  const MatrixXd response = basis.response(problem.response_um_per_kPa, threads);
  SpatialReconstruction r = reconstruct_in(basis, response, problem, traction, parameters, threads);
  if (r.lambda && problem.patch_response_um_per_nN.size() > 0)
    r.forces = forces_beside_background(problem, response, r, threads);
  if (!r.lambda) return r;
  r.flipped_z_chi_squared = chi_squared_of_flipped_z(problem, r);
  r.resolved = resolved_shares(r.covariance_kPa2, *r.lambda * *r.lambda / r.variance * norm);
  return r;
}

}  // namespace mbtfm::spatial
