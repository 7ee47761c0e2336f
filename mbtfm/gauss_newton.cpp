#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "mbtfm/tension_fit.h"
#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::inverse {

namespace {

std::vector<int> indices_where(const std::vector<bool>& is_held, bool wanted) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < is_held.size(); ++i) {
    if (is_held[i] == wanted) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

// Of the network's tension in one step: without it the links hang loose and the next derivative tells nothing of them.
constexpr double kLargestDrop = 0.9;

// Part of the whole misfit: of 10 000 beads' chi² of 20 000 this is 0.001, a thirtieth of a standard error.
constexpr double kNegligible = 5e-8;

/// None where these tensions have no equilibrium that can be found: a step too far, to be shortened.
std::optional<Trial> try_evaluate(const TensionProblem& problem, const Eigen::VectorXd& tensions_nN, TensionFit& fit) {
  ++fit.n_evaluations;
  try {
    return problem.evaluate(tensions_nN, &fit.trial);
  } catch (const NotSolved&) {
    return std::nullopt;
  }
}

}  // namespace

Eigen::VectorXd bounded_quadratic_minimum(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                                          const Eigen::VectorXd& low) {
  // Primal active set: walk from a feasible point to the minimum on the free variables; hold the first bound that is
  // met; where none is met, release the held variable that wants to leave its bound most. The objective falls with
  // each release, so no set comes twice; the bound on the steps only guards against rounding.
  const int n = static_cast<int>(g.size());
  Eigen::VectorXd x = low.cwiseMax(0.0);
  std::vector<bool> is_held(n, false);
  for (int step = 0; step < 20 * n + 20; ++step) {
    const std::vector<int> free = indices_where(is_held, false);
    Eigen::VectorXd wanted = x;
    if (!free.empty()) {
      const Eigen::VectorXd gradient = H * x + g;
      const Eigen::MatrixXd H_free = H(free, free);
      const Eigen::VectorXd move = H_free.ldlt().solve(gradient(free));
      wanted(free) -= move;
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
    const Eigen::VectorXd gradient = H * x + g;
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

TensionFit fit_gauss_newton(const TensionProblem& problem, const FitParameters& parameters,
                            const Eigen::VectorXd& start_nN) {
  TensionFit fit;
  fit.trial = problem.evaluate(scaled_to_data_nN(problem, start_nN));
  fit.n_evaluations = 2;
  double gain_of_late = 0;
  double damping = 1e-3;  // relative to the diagonal; small, as forces are nearly linear in the tensions
  Eigen::MatrixXd jacobian = problem.jacobian(fit.trial);
  for (int i = 0; i < parameters.max_steps; ++i) {
    fit.report.iterations = i + 1;
    Eigen::MatrixXd H = jacobian.transpose() * jacobian;
    const Eigen::VectorXd gradient = jacobian.transpose() * fit.trial.residual;
    // A tension that no bead feels has a zero diagonal; the floor keeps it where it is.
    const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-12 * H.diagonal().maxCoeff() + 1e-300);
    const Eigen::MatrixXd damped = H + Eigen::MatrixXd((damping * scale).asDiagonal());
    const double largest = fit.trial.tensions_nN.maxCoeff();
    Eigen::VectorXd low = -fit.trial.tensions_nN;
    if (fit.trial.tensions_nN[0] > kNoTension * largest) low[0] *= kLargestDrop;
    const Eigen::VectorXd step = bounded_quadratic_minimum(damped, gradient, low);
    fit.report.last_change = step.cwiseAbs().maxCoeff() / std::max(largest, std::numeric_limits<double>::min());

    const double predicted = -(gradient.dot(step) + 0.5 * step.dot(H * step));
    if (predicted <= 1e-15 * fit.trial.objective || step.cwiseAbs().maxCoeff() == 0) {
      fit.report.converged = true;
      fit.report.reason = "no step lowers the misfit any further";
      break;
    }
    const Eigen::VectorXd moved = (fit.trial.tensions_nN + step).cwiseMax(0.0);
    const std::optional<Trial> next = try_evaluate(problem, moved, fit);
    const double gain = next ? (fit.trial.objective - next->objective) / predicted : -1;
    if (gain > 0) fit.trial = *next;
    // A step that is short because it is damped says nothing of convergence.
    if (fit.report.last_change < parameters.tolerance && damping <= 1e-2) {
      fit.report.converged = true;
      fit.report.reason = "the tensions change by less than the tolerance";
      break;
    }
    if (gain > 0) jacobian = problem.jacobian(fit.trial);
    // Forces have kinks where a cable passes its rest length, and at a kink steps grow short but not zero.
    gain_of_late = 0.5 * gain_of_late + std::max(0.0, gain) * predicted;
    if (i >= 5 && gain > 0 && gain_of_late < kNegligible * (fit.trial.objective + 0.5 * problem.data().floor_squared)) {
      fit.report.converged = true;
      fit.report.reason = "the last steps lower the misfit by less than any bead could tell";
      break;
    }
    if (gain > 0.75) damping = std::max(1e-12, damping / 10);
    if (gain < 0.25) damping = std::max(10 * damping, gain > 0 ? 0.0 : 1e-2);
  }
  if (!fit.report.converged) {
    fit.report.reason = "the tensions still change by " + brief(fit.report.last_change) + " of the largest after " +
                        std::to_string(fit.report.iterations) + " steps";
  }
  return fit;
}

}  // namespace mbtfm::inverse
