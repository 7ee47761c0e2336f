#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>

#include "mbtfm/inverse/spectrum.h"
#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/traction_mesh.h"
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
    // With ten times the noise beads determine 4.5 times fewer numbers, and noise falls as the root of the number of
    // beads: they grow about as its cube root. Measured (notes/tractions_in_space.md).
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
  if (tractions::flat_method(method))
    throw UsageError(std::string(name_of(method)) +
                     " takes beads that a flat surface moves along itself, and these are in space: choose tikhonov, "
                     "group-l1 or patches");
  if (method == patches && inputs.adhesions.empty()) throw UsageError("patches: --adhesions is missing or holds none");
  if (method == group_l1 && traction.lambda_um_per_kPa)
    throw UsageError(
        "group-l1: lambda_um_per_kPa belongs to the other methods; this one has a penalty of its own, at which the "
        "misfit is what the noise leaves");
  return method;
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

/// Of rows with these weights, for all lambdas.
template <class Solver>
struct Scanned {
  std::shared_ptr<const Solver> solver;  ///< inverse::Spectrum, or without a matrix inverse::Recurrences
  inverse::LambdaScan scan;
};
template <class Solver>
using Scan = std::function<Scanned<Solver>(const Weighing& weighing)>;

template <class Solver>
struct Fit {
  Scanned<Solver> scanned;
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
  if (!problem.map) r.resolved = VectorXd::Zero(problem.mesh.n_vertices());
  r.remark = "no bead has moved: there is no traction";
  return r;
}

/// P W S G L and its transpose, by solutions of the gel.
inverse::LinearMap map_of(const Problem& problem, const Basis& basis, const inverse::Rows& rows) {
  const Index n_points = problem.map->rows(), n = problem.observed.n_components();
  inverse::LinearMap map;
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

ChosenLambda choose_lambda(const Problem& problem, const inverse::LambdaScan& scan,
                           const tractions::TractionParameters& traction, RiskCriterion risk_criterion) {
  using enum inverse::LambdaCriterion;
  const double unit = lambda_per_um_per_kPa(problem);
  if (traction.lambda_um_per_kPa) return {*traction.lambda_um_per_kPa * unit, {}, {}};
  const inverse::LambdaCriterion by =
      traction.lambda_by == risk && risk_criterion == RiskCriterion::use_gcv ? gcv : traction.lambda_by;
  if (by != risk) return {chosen_lambda(scan, by), by, {}};
  ChosenLambda chosen{scan.by_risk, by, {}};
  chosen.finding = noticed(Symptom::lambda_runs_away, scan.by_evidence / scan.by_risk);
  if (chosen.finding) {
    chosen.lambda = scan.by_evidence;
    chosen.by = evidence;
  }
  return chosen;
}

namespace {

template <class Solver>
struct Settled {
  Fit<Solver> fit;
  SpatialReconstruction found;  ///< without covariance
};

/// From least squares to the loss that is asked for, until the tractions stay.
/// @param scan  @param displaced  rows by the unknowns of the basis (um)
template <class Solver>
Settled<Solver> settled(const Problem& problem, const Basis& basis, const tractions::TractionParameters& traction,
                        BeadLoss loss, const Scan<Solver>& scan,
                        const std::function<VectorXd(const VectorXd&)>& displaced) {
  const Observed& observed = problem.observed;
  const std::vector<double> good = probabilities_of_good(loss, observed);
  const bool is_large = problem.map != nullptr;
  // The tractions of the weighed beads with the lambda of their own noise, or with that of `judged`: far outliers
  // that keep some weight would be followed by ever smaller lambdas, so that lambda is chosen without them.
  const auto fit = [&](Weighing weighing, const std::optional<Weighing>& judged = {}) {
    Fit<Solver> made;
    made.scanned = scan(weighing);
    if (judged) made.scanned.scan = scan(*judged).scan;
    made.chosen = choose_lambda(problem, made.scanned.scan, traction,
                                weighs_by_residual(loss) || is_large ? RiskCriterion::use_gcv : RiskCriterion::usable);
    if (judged && made.chosen.by)
      made.chosen.lambda *= std::sqrt(weighing.variance / judged->variance);  // the same prior
    made.x = made.scanned.solver->solve(made.chosen.lambda);
    made.weighing = std::move(weighing);
    return made;
  };
  const VectorXd displacement_um = problem.displacement_um();
  const auto residual = [&](const Fit<Solver>& made) {
    return problem.over_errors(displacement_um - displaced(made.x), made.weighing.by_row);
  };
  const auto degrees = [](const Fit<Solver>& made) { return made.scanned.solver->degrees(made.chosen.lambda); };
  std::vector<BeadLoss> in_turn;
  if (loss == BeadLoss::biweight) in_turn.push_back(BeadLoss::huber);  // as inverse::in_turn()
  if (loss != BeadLoss::l2) in_turn.push_back(loss);
  Fit<Solver> last = fit(weigh(BeadLoss::l2, observed, displacement_um.cwiseQuotient(observed.sigma_um), 0));
  for (const BeadLoss step : in_turn) {
    constexpr double kSettled = 0.005;
    const int most_rounds = !weighs_by_residual(step) ? 1 : is_large ? 4 / static_cast<int>(in_turn.size()) : 12;
    double change = 1;
    for (int round = 0; round < most_rounds && change > kSettled; ++round) {
      const VectorXd left = residual(last);
      std::optional<Weighing> judged;
      if (!is_large && weighs_by_residual(step) && step != BeadLoss::biweight)
        judged = weigh(BeadLoss::biweight, observed, left, degrees(last));
      Fit<Solver> next = fit(weigh(step, observed, left, degrees(last), good), judged);
      change = (next.x - last.x).norm() / std::max(next.x.norm(), 1e-300);
      last = std::move(next);
    }
  }
  SpatialReconstruction r;
  r.lambda = last.chosen.lambda;
  r.lambda_by = last.chosen.by;
  r.findings.push_back(last.chosen.finding);
  r.length_um = *r.lambda / lambda_per_um_per_kPa(problem) * problem.gel.youngs_modulus_kPa;
  r.traction_kPa = basis.tractions(last.x);
  r.degrees = degrees(last);
  r.relative_l2 = last.scanned.solver->relative_l2(*r.lambda);
  r.weighing = weigh(loss, observed, residual(last), r.degrees, good);
  r.scan = last.scanned.scan;
  r.variance = std::max(weighs_by_residual(loss) ? r.weighing.variance : r.scan->variance, problem.least_variance());
  return {std::move(last), std::move(r)};
}

/// Where the problem has no matrix. No standard errors.
SpatialReconstruction reconstruct_large(const Problem& problem, const tractions::TractionParameters& traction,
                                        const SpatialParameters& parameters) {
  if (problem.displacement_um().isZero(0)) return reconstruction_of_nothing(problem);
  const Basis basis = orthonormal_basis(problem.norm_um2());
  const Scan<inverse::Recurrences> scan = [&](const Weighing& weighing) {
    const inverse::Rows rows = rows_of(problem, weighing.by_row);
    const auto recurrences = std::make_shared<const inverse::Recurrences>(
        map_of(problem, basis, rows), rows.of(problem.displacement_um()), inverse::RecurrenceOptions{});
    return Scanned<inverse::Recurrences>{recurrences,
                                         recurrences->scan(stated_variance(problem, parameters.loss, weighing))};
  };
  SpatialReconstruction r =
      settled<inverse::Recurrences>(
          problem, basis, traction, parameters.loss, scan,
          [&](const VectorXd& x) -> VectorXd { return problem.at_beads(problem.map->displace(basis.tractions(x))); })
          .found;
  r.remark = "standard errors are computed of up to " + std::to_string(kMostVertices) + " vertices, and there are " +
             std::to_string(problem.mesh.n_vertices());
  return r;
}

}  // namespace

SpatialReconstruction reconstruct_in(const Basis& basis, const MatrixXd& response, const Problem& problem,
                                     const tractions::TractionParameters& traction, const SpatialParameters& parameters,
                                     int threads) {
  if (problem.displacement_um().isZero(0)) return reconstruction_of_nothing(problem);
  const Scan<inverse::Spectrum> scan = [&](const Weighing& weighing) {
    const auto spectrum = std::make_shared<const inverse::Spectrum>(
        spectrum_of(problem, response, weighing.by_row, weighing.n_data, threads));
    const auto stated = stated_variance(problem, parameters.loss, weighing);
    return Scanned<inverse::Spectrum>{
        spectrum, spectrum->scan(largest(stated, spectrum->variance_felt_least()), inverse::SignalIn::resolved)};
  };
  auto [fit, r] = settled<inverse::Spectrum>(problem, basis, traction, parameters.loss, scan,
                                             [&](const VectorXd& x) -> VectorXd { return response * x; });
  const inverse::Spectrum& spectrum = *fit.scanned.solver;
  const double loose = r.scan->by_gcv;
  const double n_data = fit.weighing.n_data;  // less where weights are small; a tenth at least is left, as in `weigh`
  r.variance_left = spectrum.misfit(loose) / std::max(n_data - spectrum.degrees(loose), 0.1 * n_data);
  r.covariance_kPa2 = basis.covariance(spectrum.posterior(*r.lambda, r.variance), threads);
  if (r.lambda_by == inverse::LambdaCriterion::risk) {
    const double of_sums = r.scan->by_prediction;
    r.summands = Summands{basis.tractions(spectrum.solve(of_sums)),
                          basis.covariance(spectrum.posterior(of_sums, r.variance), threads), of_sums};
  }
  return std::move(r);
}

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
