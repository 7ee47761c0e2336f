/// Vectors most of which are zero: least squares with the sum of their lengths as penalty.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <utility>

#include "pipeline/contract/report.h"

namespace mbtfm::inverse {

/// By place: the length of a vector whose components lie apart by the number of places.
inline Eigen::ArrayXd lengths_of(const Eigen::VectorXd& x, Eigen::Index n_places) {
  return x.reshaped(n_places, x.size() / n_places).rowwise().norm();
}

/// When alternating directions have settled: both are relative.
struct Settled {
  double change = 0;  ///< of the vectors from one step to the next
  double gap = 0;     ///< between the vectors with and without their penalty
  int most_steps = 0;
};

/// Minimises ½ |A x − u|² + mu Σ w |x_i| over vectors x_i, for several mu in turn, by alternating directions (Boyd et
/// al., Found. Trends Mach. Learn. 3 (2011) 1, section 6.4): x solves a Tikhonov problem, z is x and the dual over rho
/// with all vectors shortened by mu w / rho, the dual gathers what parts x from z.
class GroupLasso {
 public:
  /// (AᵀA + rho)⁻¹ (Aᵀu + added)
  using Solve = std::function<Eigen::VectorXd(const Eigen::VectorXd& added, double rho)>;
  /// @param weights  w, by place
  /// @param largest  about the largest |x_i|: sets the size of a good step, no more
  GroupLasso(Solve solve, Eigen::Index n_unknowns, Eigen::ArrayXd weights, double largest, const Settled& settled)
      : solve_(std::move(solve)),
        weights_(std::move(weights)),
        largest_(largest),
        settled_(settled),
        z_(Eigen::VectorXd::Zero(n_unknowns)),
        dual_(z_) {}

  Report minimise(double mu) {
    constexpr double kShortening = 0.1;  // of the largest; measured: two to five times as many steps at 0.01 and at 1
    const double rho = mu * weights_.mean() / (kShortening * largest_);
    Report report{.converged = false, .iterations = 0, .last_change = 1, .reason = {}};
    for (; report.iterations < settled_.most_steps && !report.converged; ++report.iterations) {
      const Eigen::VectorXd x = solve_(rho * z_ - dual_, rho), v = x + dual_ / rho;
      const Eigen::ArrayXd lengths = lengths_of(v, weights_.size()).max(1e-300);
      const Eigen::VectorXd shares = (1 - mu / rho * weights_ / lengths).max(0);
      const Eigen::VectorXd next = v.cwiseProduct(shares.replicate(v.size() / shares.size(), 1));
      const double size = next.norm();
      report.last_change = size > 0 ? (next - z_).norm() / size : 1;
      report.converged = report.last_change <= settled_.change && (x - next).norm() <= settled_.gap * size;
      z_ = next;
      dual_ += rho * (x - z_);
    }
    n_steps_ += report.iterations;
    report.reason = report.converged ? "the tractions settled" : "the tractions still change after all steps";
    return report;
  }
  const Eigen::VectorXd& x() const { return z_; }
  int n_steps() const { return n_steps_; }  ///< of all mu so far

 private:
  Solve solve_;
  Eigen::ArrayXd weights_;
  double largest_;
  Settled settled_;
  Eigen::VectorXd z_, dual_;
  int n_steps_ = 0;
};

}  // namespace mbtfm::inverse
