#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::tensions {

namespace {

std::vector<int> indices_where(const std::vector<bool>& is_held, bool wanted) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < is_held.size(); ++i)
    if (is_held[i] == wanted) indices.push_back(static_cast<int>(i));
  return indices;
}

// Of a tension in one step. A cable without tension hangs loose, and its derivative then does not predict a taut one:
// who lets a fibre go slack on the word of a far-off derivative may never see it pull again.
constexpr double kLargestDrop = 0.7;
// Of the largest tension: below this a fibre may go to zero.
constexpr double kLetGo = 0.01;
// Of the largest tension: a fibre below this may hang loose in a minimum that the taut one's is lower than.
constexpr double kSlack = 0.05;

// Of the variance of one component, in 2 Phi, by tension: a thirtieth of a standard error along one direction of
// twenty; a tenth.
constexpr double kNegligible = 5e-5, kNegligibleAtFirst = 5e-4;
// Steps that together must lower Phi by more than that.
constexpr std::size_t kLastSteps = 3;
// Of the data, left unexplained: less than any experiment leaves.
constexpr double kExplained = 1e-3;
// A refused step is damped by no less: at a smaller part of the diagonal the next one would be the same again.
constexpr double kFirstRefusal = 0.3;

/// What no bead could resolve, in Phi; nor exact beads, as forces are known to some 1e-10.
double negligible(const TensionProblem& problem, double objective, Search search = Search::best) {
  constexpr double kRounding = 1e-20;
  const double part = (search == Search::best ? kNegligible : kNegligibleAtFirst) * problem.n_tensions();
  const ReducedData& data = problem.data();
  const double whole = objective + 0.5 * data.floor_squared;
  return std::max(part * whole / static_cast<double>(std::max<Index>(1, data.n_components)),
                  kRounding * data.target.squaredNorm());
}

/// How far each tension may fall in one step.
VectorXd lowest_step(const VectorXd& tensions_nN) {
  const double largest = tensions_nN.maxCoeff();
  VectorXd low = -tensions_nN;
  for (Index i = 0; i < low.size(); ++i) {
    if (tensions_nN[i] > (i == 0 ? kNoTension : kLetGo) * largest) low[i] *= kLargestDrop;
  }
  return low;
}

/// None where these tensions have no equilibrium that can be found: a step too far, to be shortened.
std::optional<Trial> try_evaluate(const TensionProblem& problem, const VectorXd& tensions_nN, TensionFit& fit,
                                  double force_tolerance) {
  ++fit.n_evaluations;
  try {
    return problem.evaluate(tensions_nN, &fit.trial, force_tolerance);
  } catch (const NotSolved&) {
    return std::nullopt;
  }
}

/// Of an equilibrium, so that what is left of its net forces moves Phi by no more than a hundredth of the gain that is
/// at stake: |r| |C dR| for forces that are off by that part of themselves.
double force_tolerance(const Trial& trial, const TensionProblem& problem, double at_stake) {
  constexpr double kRoughest = 1e-3, kFinest = 1e-9;
  const double size = trial.residual.norm() * (trial.residual + problem.data().target).norm();
  return std::clamp(0.01 * at_stake / std::max(size, 1e-300), kFinest, kRoughest);
}

struct Step {
  VectorXd change_nN;
  double predicted = 0;  ///< by how much it lowers Phi, if that is quadratic
};

/// What a step changes of the gradient beyond JᵀJ, r · d²(C R)/dt², learnt from what the last steps changed (Dennis,
/// Gay & Welsch, ACM Trans. Math. Softw. 7 (1981) 348). Where noise leaves residuals and cables pass their rest length,
/// JᵀJ alone promises several times what a step gains, and shorter and shorter steps are all that helps.
/// @param before, after  trials before and after a step, with their Jacobians
void learn_bend(MatrixXd& bend, const Trial& before, const MatrixXd& jacobian_before, const Trial& after,
                const MatrixXd& jacobian_after) {
  const VectorXd s = after.tensions_nN - before.tensions_nN;
  const VectorXd gradient = numerics::transposed_matvec(jacobian_after, after.residual);
  const VectorXd y = gradient - numerics::transposed_matvec(jacobian_before, before.residual);
  const VectorXd wanted = gradient - numerics::transposed_matvec(jacobian_before, after.residual);  // of bend · s
  const double y_s = y.dot(s);
  constexpr double kLeast = 1e-3;  // less curvature than that part of JᵀJ's is no minimum's
  if (y_s <= kLeast * numerics::matvec(jacobian_after, s).squaredNorm()) return;
  const double size = numerics::quadratic_form(bend, s);
  if (size != 0) bend *= std::min(1.0, std::abs(s.dot(wanted) / size));
  const VectorXd rest = numerics::minus_matvec(wanted, bend, s);
  bend += (rest * y.transpose() + y * rest.transpose()) / y_s - rest.dot(s) / (y_s * y_s) * y * y.transpose();
}

/// @param bend  see learn_bend(); left out where it takes more than half of the curvature away
Step damped_step(const Trial& trial, const MatrixXd& jacobian, const MatrixXd& bend, double damping) {
  const MatrixXd straight = numerics::gram(jacobian);
  const VectorXd gradient = numerics::transposed_matvec(jacobian, trial.residual);
  // A tension that hardly any bead feels would run away: a thousandth of the middle one's weight
  // damps its steps, but moves no minimum.
  const VectorXd scale = straight.diagonal();
  const VectorXd weak =
      VectorXd::Constant(scale.size(), 1e-6 * numerics::median(std::vector(scale.begin(), scale.end())) + 1e-300);
  const MatrixXd least = 0.5 * straight + bend + MatrixXd(weak.asDiagonal());
  const bool is_convex = numerics::SmallCholesky(least).is_definite();
  const MatrixXd H = is_convex ? straight + bend : straight;
  const MatrixXd damped = H + MatrixXd((damping * scale + weak).asDiagonal());
  const VectorXd step = bounded_quadratic_minimum(damped, gradient, lowest_step(trial.tensions_nN));
  return {.change_nN = step, .predicted = -(gradient.dot(step) + 0.5 * numerics::quadratic_form(H, step))};
}

/// By how much the last steps lowered Phi.
double gained_of_late(const TensionFit& fit) {
  if (fit.report.iterations < static_cast<int>(kLastSteps)) return std::numeric_limits<double>::infinity();
  return fit.history[fit.history.size() - kLastSteps].objective - fit.trial.objective;
}

/// Whether a descent may end before its time.
using Enough = std::function<bool(const Trial&)>;

/// Levenberg–Marquardt from fit.trial, the Hessian bent.
void descend(const TensionProblem& problem, const FitParameters& parameters, Search search, TensionFit& fit,
             const Enough& is_enough = {}) {
  fit.report = {};
  double damping = 1e-3;  // relative to the diagonal; small, as forces are nearly linear in the tensions
  const auto has_ended = [&](const char* reason) {
    fit.report.converged = true;
    fit.report.reason = reason;
  };
  MatrixXd jacobian = problem.jacobian(fit.trial);
  MatrixXd bend = MatrixXd::Zero(jacobian.cols(), jacobian.cols());
  for (int i = 0; i < parameters.max_steps; ++i) {
    if (is_enough && is_enough(fit.trial)) return has_ended("nothing else is to be found there");
    fit.report.iterations = i + 1;
    fit.history.push_back({.n_evaluations = fit.n_evaluations, .objective = fit.trial.objective});
    // no more is left to bend where the data are exact, and JᵀJ alone then ends in a step or two
    if (fit.trial.residual.norm() < kExplained * problem.data().target.norm()) bend.setZero();
    const auto [step, predicted] = damped_step(fit.trial, jacobian, bend, damping);
    const double largest = std::max(fit.trial.tensions_nN.maxCoeff(), std::numeric_limits<double>::min());
    fit.report.last_change = step.cwiseAbs().maxCoeff() / largest;
    if (predicted <= 1e-15 * fit.trial.objective || step.cwiseAbs().maxCoeff() == 0)
      return has_ended("no step lowers the misfit any further");

    std::optional<Trial> next = try_evaluate(problem, (fit.trial.tensions_nN + step).cwiseMax(0.0), fit,
                                             force_tolerance(fit.trial, problem, predicted));
    const double gain = next ? (fit.trial.objective - next->objective) / predicted : -1;
    if (gain > 0) std::swap(fit.trial, *next);  // which then is the one before
    // A step that is short because it is damped says nothing of convergence.
    if (fit.report.last_change < parameters.tolerance && damping <= 1e-2)
      return has_ended("the tensions change by less than the tolerance");
    // Forces have kinks where a cable passes its rest length, and at a kink steps grow short but not zero.
    const double resolved = negligible(problem, fit.trial.objective, search);
    if ((predicted < resolved && damping <= 1e-2) || (gain > 0 && gained_of_late(fit) < resolved))
      return has_ended("the last steps lower the misfit by less than any bead could tell");
    if (gain > 0) {
      MatrixXd after = problem.jacobian(fit.trial);
      learn_bend(bend, *next, jacobian, fit.trial, after);
      jacobian = std::move(after);
    }
    if (gain > 0.75) damping = std::max(1e-12, damping / 10);
    if (gain < 0.25) damping = std::max(10 * damping, gain > 0 ? 0.0 : kFirstRefusal);
  }
  fit.report.reason = "the tensions still change by " + brief(fit.report.last_change) + " of the largest after " +
                      std::to_string(fit.report.iterations) + " steps";
}

/// H⁻¹ b, in blocks where rounding leaves H positive definite.
VectorXd solve_positive(const MatrixXd& H, const VectorXd& b) {
  const numerics::SmallCholesky quick(H);
  return quick.is_definite() ? quick.solve(b) : VectorXd(numerics::solve_symmetric(H, b));
}

bool is_slack(const VectorXd& tensions_nN, Index i) { return tensions_nN[i] <= kSlack * tensions_nN.maxCoeff(); }

/// Whether a trial has come back to where the minimum was: the same fibres slack, and no further than a standard error.
Enough is_back_at(const TensionProblem& problem, const Trial& minimum) {
  const double whole = 2 * minimum.objective + problem.data().floor_squared;
  const double variance = whole / static_cast<double>(std::max<Index>(1, problem.data().n_components));
  return [jacobian = problem.jacobian(minimum), at = minimum.tensions_nN, variance](const Trial& trial) {
    for (Index i = 1; i < at.size(); ++i)
      if (is_slack(trial.tensions_nN, i) != is_slack(at, i)) return false;
    return numerics::matvec(jacobian, trial.tensions_nN - at).squaredNorm() < variance;
  };
}

/// Tensions that came out slack, set to the median of the others; none where there are none.
std::optional<VectorXd> slack_ones_raised(const VectorXd& tensions_nN) {
  std::vector<double> taut;
  for (Index i = 1; i < tensions_nN.size(); ++i)
    if (!is_slack(tensions_nN, i)) taut.push_back(tensions_nN[i]);
  if (taut.empty() || taut.size() + 1 == static_cast<std::size_t>(tensions_nN.size())) return std::nullopt;
  const double middle = numerics::median_in(taut);
  VectorXd raised = tensions_nN;
  for (Index i = 1; i < raised.size(); ++i)
    if (is_slack(tensions_nN, i)) raised[i] = middle;
  return raised;
}

/// Try the other side of slack fibres as long as it pays.
void look_beyond_slack(const TensionProblem& problem, const FitParameters& parameters, TensionFit& fit) {
  constexpr int kMaxRounds = 3;
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::optional<VectorXd> raised = slack_ones_raised(fit.trial.tensions_nN);
    if (!raised) break;
    TensionFit other = fit;
    const std::optional<Trial> raised_trial =
        try_evaluate(problem, *raised, other, force_tolerance(fit.trial, problem, fit.trial.objective));
    if (!raised_trial) break;
    other.trial = *raised_trial;
    descend(problem, parameters, Search::best, other, is_back_at(problem, fit.trial));
    fit.n_evaluations = other.n_evaluations;
    if (other.trial.objective >= fit.trial.objective - negligible(problem, fit.trial.objective)) break;
    fit = std::move(other);
  }
}

}  // namespace

VectorXd bounded_quadratic_minimum(const MatrixXd& H, const VectorXd& g, const VectorXd& low) {
  // Primal active set: walk from a feasible point to the minimum on the free variables; hold the first bound that is
  // met; where none is met, release the held variable that wants to leave its bound most. The objective falls with
  // each release, so no set comes twice; the bound on the steps only guards against rounding.
  const int n = static_cast<int>(g.size());
  VectorXd x = low.cwiseMax(0.0);
  // What is pressed against its bound from the start is held from the start: found one by one, each costs a step.
  std::vector<bool> is_held(n, false);
  const VectorXd slope = numerics::matvec(H, x) + g;
  for (int i = 0; i < n; ++i) is_held[i] = x[i] <= low[i] && slope[i] > 0;
  for (int step = 0; step < 20 * n + 20; ++step) {
    const std::vector<int> free = indices_where(is_held, false);
    VectorXd wanted = x;
    if (!free.empty()) {
      const VectorXd gradient = numerics::matvec(H, x) + g;
      wanted(free) -= solve_positive(H(free, free), gradient(free));
    }
    double fraction = 1;
    int blocking = -1;
    for (const int i : free) {
      if (wanted[i] >= low[i]) continue;
      const double reach = (low[i] - x[i]) / (wanted[i] - x[i]);
      if (reach < fraction) {
        fraction = reach;
        blocking = i;
      }
    }
    x += fraction * (wanted - x);
    if (blocking >= 0) {
      x[blocking] = low[blocking];
      is_held[blocking] = true;
      continue;
    }
    const VectorXd gradient = numerics::matvec(H, x) + g;
    int leaving = -1;
    double steepest = -1e-14 * (g.cwiseAbs().maxCoeff() + std::numeric_limits<double>::min());
    for (const int i : indices_where(is_held, true)) {
      if (gradient[i] < steepest) {
        steepest = gradient[i];
        leaving = i;
      }
    }
    if (leaving < 0) break;
    is_held[leaving] = false;
  }
  return x.cwiseMax(low);
}

TensionFit fit_gauss_newton(const TensionProblem& problem, const FitParameters& parameters, const Trial& start,
                            Search search) {
  TensionFit fit;
  fit.trial = start;
  descend(problem, parameters, search, fit);
  if (search == Search::nearest) return fit;
  look_beyond_slack(problem, parameters, fit);
  fit.trial = problem.evaluate(fit.trial.tensions_nN, &fit.trial);  // to the last digit
  return fit;
}

}  // namespace mbtfm::tensions
