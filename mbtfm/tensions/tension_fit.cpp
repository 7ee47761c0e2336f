#include "mbtfm/tensions/tension_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::tensions {

void declare(stage::ParameterList& list, FitParameters& p) {
  list.table("fit");
  list.add("method", p.method);
  list.add("gradients", p.gradients);
  list.add("robust_kind", p.robust_kind, {}, {Loss::huber, Loss::tukey, Loss::l1});
  list.add("substrate", p.substrate);
  list.add("region_um", p.region_um, Range::zero_or_size_um());
  list.add("n_meshes", p.n_meshes, Range::between(1, 1000));
  list.add("tolerance", p.tolerance, Range::between(1e-15, 1));
  list.add("max_steps", p.max_steps, Range::between(1, 100000));
  list.add("max_evaluations", p.max_evaluations, Range::between(1, 10000000));
  list.add("far_distance_um", p.far_distance_um, Range::zero_or_size_um());
  list.add("frame_interval_s", p.frame_interval_s, Range::between(1e-6, 1e7));
  list.add("bootstrap", p.bootstrap, Range::between(0, 1000000));
  list.add("surface_lines", p.surface_lines, Range::between(8, 10000));
  list.add("cross_validation", p.cross_validation, Range::between(0, 1000000));
}

TensionFit fit_tensions(const TensionProblem& problem, const FitParameters& parameters, int threads, const Trial& start,
                        Search search) {
  if (parameters.method == FitMethod::gauss_newton) return fit_gauss_newton(problem, parameters, start, search);
  std::vector<int> all(problem.n_tensions());
  std::iota(all.begin(), all.end(), 0);
  if (parameters.method == FitMethod::plain_cg) {
    return fit_conjugate_gradients(problem, parameters, threads, start, {{.tensions = all, .n_steps = 10}});
  }
  // thesis 3.2.5: one step on the network, ten on the fibres
  const std::vector<int> fibres(all.begin() + 1, all.end());
  std::vector<Block> blocks = {{.tensions = {0}, .n_steps = 1}};
  if (!fibres.empty()) blocks.push_back({.tensions = fibres, .n_steps = 10});
  return fit_conjugate_gradients(problem, parameters, threads, start, blocks);
}

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

TensionProblem::TensionProblem(const network::Contractile& cell, const ReducedData& data,
                               const std::vector<int>& adhesion_ids, SolvedMisfit solved_misfit, int threads)
    : cell_(cell),
      data_(data),
      adhesion_ids_(adhesion_ids),
      solved_misfit_(std::move(solved_misfit)),
      threads_(threads) {
  MBTFM_ASSERT(data.compliance->cols() == data.dimension * static_cast<Index>(adhesion_ids.size()));
  for (const int id : cell.adhesion_ids()) {
    const auto at = std::find(adhesion_ids.begin(), adhesion_ids.end(), id);
    if (at == adhesion_ids.end()) {
      throw InvalidData("adhesion " + std::to_string(id) + " of the network", "an adhesion of the cell",
                        "none of that label");
    }
    pair_of_.push_back(at - adhesion_ids.begin());
  }
}

MatrixXd TensionProblem::to_data_rows(const MatrixXd& by_adhesion_of_cell) const {
  MatrixXd rows = MatrixXd::Zero(data_.compliance->cols(), by_adhesion_of_cell.cols());
  for (std::size_t i = 0; i < pair_of_.size(); ++i) {
    const Index each = data_.dimension;
    rows.middleRows(each * pair_of_[i], each) = by_adhesion_of_cell.middleRows(each * static_cast<Index>(i), each);
  }
  return rows;
}

Trial TensionProblem::evaluate(const VectorXd& tensions_nN, const Trial* nearby,
                               std::optional<double> force_tolerance) const {
  Trial trial{.tensions_nN = tensions_nN, .rest = {}, .forces_nN = {}, .residual = {}};
  trial.rest = cell_.at_rest(tensions_nN, nearby ? nearby->rest.get() : nullptr, force_tolerance);
  if (!trial.rest->report().converged) throw NotSolved(trial.rest->report());
  trial.forces_nN = to_data_rows(trial.rest->forces_nN());
  trial.residual = numerics::matvec(*data_.compliance, trial.forces_nN) - data_.target;
  trial.objective =
      0.5 * (solved_misfit_ ? solved_misfit_(trial.forces_nN) - data_.floor_squared : trial.residual.squaredNorm());
  return trial;
}

VectorXd TensionProblem::network_part_nN(const Trial& trial) const {
  return to_data_rows(trial.rest->network_part_nN());
}

VectorXd TensionProblem::torques_nN_um(const Trial& trial) const {
  const VectorXd torques = trial.rest->torques_nN_um();
  VectorXd rows = VectorXd::Zero(static_cast<Index>(adhesion_ids_.size()));
  for (std::size_t i = 0; i < pair_of_.size(); ++i) rows[pair_of_[i]] = torques[static_cast<Index>(i)];
  return rows;
}

MatrixXd TensionProblem::force_derivatives(const Trial& trial) const {
  return to_data_rows(trial.rest->force_derivatives(threads_));
}

VectorXd TensionProblem::gradient(const Trial& trial) const {
  return numerics::transposed_matvec(jacobian(trial), trial.residual);
}

VectorXd TensionProblem::finite_difference_gradient(const Trial& trial, int threads) const {
  const double largest = trial.tensions_nN.maxCoeff();
  VectorXd gradient(n_tensions());
  numerics::parallel_for(n_tensions(), threads, [&](int i) {
    // A third of the digits of a double go into the step, which stays on the allowed side of zero. It must be far above
    // the 1e-7 of the largest tension that represents a zero one: below, nothing changes, and who is at zero stays
    // there.
    const double step = 1e-5 * std::max(largest, 1e-12);
    VectorXd above = trial.tensions_nN, below = trial.tensions_nN;
    above[i] += step;
    below[i] = std::max(0.0, below[i] - step);
    const double difference = evaluate(above, &trial).objective - evaluate(below, &trial).objective;
    gradient[i] = difference / (above[i] - below[i]);
  });
  return gradient;
}

Trial scaled_to_data(const TensionProblem& problem, const VectorXd& tensions_nN, const Trial* nearby) {
  constexpr double kRough = 1e-3;  // its size is all that is asked for
  const Trial trial = problem.evaluate(tensions_nN, nearby, kRough);
  const VectorXd response = numerics::matvec(*problem.data().compliance, trial.forces_nN);
  double factor = response.dot(problem.data().target) / std::max(response.squaredNorm(), 1e-300);
  // Where the cell seems to push, as noise alone may look, any small positive size serves.
  if (factor <= 0) factor = 1e-3 / std::max(tensions_nN.maxCoeff(), 1e-300);
  return problem.evaluate(factor * tensions_nN, &trial);
}

Trial uniform_start(const TensionProblem& problem) {
  Trial start = scaled_to_data(problem, VectorXd::Ones(problem.n_tensions()));
  const ReducedData& data = problem.data();
  const VectorXd pull = numerics::matvec(*data.compliance, start.forces_nN).normalized();
  const auto n_free = static_cast<double>(std::max<Index>(1, data.n_components - data.n_felt));
  const double sigma = std::sqrt(std::max(data.floor_squared, 1e-300) / n_free);  // of a component of the data
  constexpr double kCertain = 6;  // standard errors: noise alone pushes by two or three, once in 1e9 by six
  if (const double pulled = pull.dot(data.target); pulled < -kCertain * sigma) {
    throw InvalidData("the displacement", "beads that a contracting cell pulls inward",
                      "beads that move the other way, by " + brief(-pulled / sigma) +
                          " standard errors: are the stressed and the relaxed image exchanged, or is the sign of the "
                          "displacement or of an axis reversed?");
  }
  return start;
}

}  // namespace mbtfm::tensions
