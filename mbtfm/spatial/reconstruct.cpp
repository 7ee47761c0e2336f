#include <algorithm>
#include <cmath>

#include "mbtfm/spatial/reconstruction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/numerics/order_statistics.h"

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

}  // namespace mbtfm::spatial
