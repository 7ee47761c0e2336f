#include "mbtfm/tensions/tension_problem.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::tensions {

TensionProblem::TensionProblem(const network::Contractile& cell, const ReducedData& data,
                               const std::vector<int>& adhesion_ids, SolvedMisfit solved_misfit, int threads)
    : cell_(cell),
      data_(data),
      adhesion_ids_(adhesion_ids),
      solved_misfit_(std::move(solved_misfit)),
      threads_(threads) {
  MBTFM_ASSERT(data.compliance->cols() == 2 * static_cast<Index>(adhesion_ids.size()));
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
    rows.middleRows<2>(2 * pair_of_[i]) = by_adhesion_of_cell.middleRows<2>(2 * static_cast<Index>(i));
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
  VectorXd rows = VectorXd::Zero(data_.compliance->cols() / 2);
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
    // the 1e-7 of the largest tension that a zero one stands for: below, nothing changes, and who is at zero stays
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
