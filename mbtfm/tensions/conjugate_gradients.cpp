#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::tensions {

namespace {

/// The state of a minimisation, and its account of evaluations.
class Minimisation {
 public:
  Minimisation(const TensionProblem& problem, const FitParameters& parameters, int threads, const Trial& start)
      : problem_(problem), parameters_(parameters), threads_(threads) {
    fit_.trial = start;
  }

  TensionFit& fit() { return fit_; }
  bool is_exhausted() const { return fit_.n_evaluations >= parameters_.max_evaluations; }

  VectorXd gradient() {
    if (parameters_.gradients == Gradients::exact) return problem_.gradient(fit_.trial);
    fit_.n_evaluations += 2 * problem_.n_tensions();
    return problem_.finite_difference_gradient(fit_.trial, threads_);
  }

  /// Go along `direction` to about the lowest point, on t >= 0: double the step while it pays, else halve it.
  /// @return the step taken, in units of `direction`; 0 where no step pays
  double search_line(const VectorXd& direction, double first_step) {
    double step = first_step;
    Trial best = at(step, direction);
    if (best.objective < fit_.trial.objective) {
      for (Trial next = at(2 * step, direction); next.objective < best.objective && !is_exhausted();
           next = at(2 * step, direction)) {
        best = std::move(next);
        step *= 2;
      }
    } else {
      while (best.objective >= fit_.trial.objective) {
        if (step < 1e-12 * first_step || is_exhausted()) return 0;
        step /= 2;
        best = at(step, direction);
      }
    }
    // The parabola through the start, the best and its double: one more trial at its vertex.
    const double slope_to_best = (best.objective - fit_.trial.objective) / step;
    const Trial beyond = at(2 * step, direction);
    const double curvature = ((beyond.objective - best.objective) / step - slope_to_best) / step;
    if (curvature > 0) {
      const double vertex = 0.5 * step - slope_to_best / curvature;
      Trial refined = at(std::clamp(vertex, 0.1 * step, 2 * step), direction);
      if (refined.objective < best.objective) best = std::move(refined);
    }
    fit_.trial = std::move(best);
    fit_.history.push_back({.n_evaluations = fit_.n_evaluations, .objective = fit_.trial.objective});
    return step;
  }

 private:
  Trial at(double step, const VectorXd& direction) {
    Trial trial = problem_.evaluate((fit_.trial.tensions_nN + step * direction).cwiseMax(0.0), &fit_.trial);
    ++fit_.n_evaluations;
    return trial;
  }
  const TensionProblem& problem_;
  const FitParameters& parameters_;
  int threads_;
  TensionFit fit_;
};

/// The gradient on a block's tensions only, without what would push one below zero.
VectorXd projected(const VectorXd& gradient, const VectorXd& tensions, const Block& block) {
  VectorXd part = VectorXd::Zero(gradient.size());
  for (const int i : block.tensions) {
    if (tensions[i] > 0 || gradient[i] < 0) part[i] = gradient[i];
  }
  return part;
}

}  // namespace

TensionFit fit_conjugate_gradients(const TensionProblem& problem, const FitParameters& parameters, int threads,
                                   const Trial& start, const std::vector<Block>& blocks) {
  Minimisation minimisation(problem, parameters, threads, start);
  TensionFit& fit = minimisation.fit();
  std::vector<double> first_step(blocks.size(), 0);
  while (!minimisation.is_exhausted() && !fit.report.converged) {
    const VectorXd before = fit.trial.tensions_nN;
    const double objective_before = fit.trial.objective;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      VectorXd last_descent, direction;
      for (int step = 0; step < blocks[b].n_steps && !minimisation.is_exhausted(); ++step) {
        const VectorXd descent = -projected(minimisation.gradient(), fit.trial.tensions_nN, blocks[b]);
        if (descent.squaredNorm() == 0) break;
        // Polak–Ribière, restarted where it would go uphill
        const bool is_first = direction.size() == 0;
        const double beta =
            is_first ? 0 : std::max(0.0, descent.dot(descent - last_descent) / last_descent.squaredNorm());
        direction = is_first ? descent : VectorXd(descent + beta * direction);
        if (direction.dot(descent) <= 0) direction = descent;
        last_descent = descent;
        if (first_step[b] == 0) first_step[b] = 0.1 * fit.trial.tensions_nN.maxCoeff() / direction.norm();
        const double taken = minimisation.search_line(direction, first_step[b]);
        if (taken == 0) break;
        first_step[b] = taken;
      }
    }
    ++fit.report.iterations;
    fit.report.last_change = (fit.trial.tensions_nN - before).cwiseAbs().maxCoeff() / fit.trial.tensions_nN.maxCoeff();
    fit.report.converged = fit.report.last_change < parameters.tolerance || fit.trial.objective == objective_before;
  }
  fit.report.reason = fit.report.converged
                          ? "the tensions change by less than the tolerance"
                          : "the tensions still change by " + brief(fit.report.last_change) + " of the largest after " +
                                std::to_string(fit.n_evaluations) + " evaluations";
  return fit;
}

}  // namespace mbtfm::tensions
