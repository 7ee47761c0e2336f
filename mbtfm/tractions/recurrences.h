/// Every lambda of a linear problem whose matrix is never formed: Golub–Kahan recurrences side by side.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "mbtfm/tractions/spectrum.h"

namespace mbtfm::tractions {

/// A and Aᵀ on columns; many at a time cost hardly more than one.
struct LinearMap {
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)> forward, transposed;
  Eigen::Index n_data = 0, n_unknowns = 0;
};

struct RecurrenceOptions {
  int steps = 96;  ///< the solution at lambdas of noisy data is then exact to 1e-6 and better
  int probes = 8;  ///< vectors of random signs: with them the recurrences see some hundred directions of the matrix
  std::uint64_t seed = 1;
};

/// |A s − u|² + lambda² |s|². One recurrence from the data gives the solution for all lambdas. It sees few of the other
/// directions of the matrix: traces of its own small problem would be those of another one, and lambda by
/// cross-validation comes out several times too small with them. Recurrences from vectors of random signs see them, and
/// what all have met together is a space in which A has its large singular values (Rayleigh and Ritz; Halko, Martinsson
/// & Tropp, SIAM Rev. 53 (2011) 217): the criteria are those of A on it. The mean of zᵀ H z over the random vectors
/// (Hutchinson) needs no such space, and its noise moves the risk's lambda by a fifth.
/// All vectors of a recurrence are made orthogonal to those before.
class Recurrences {
 public:
  Recurrences(const LinearMap& map, const Eigen::VectorXd& data, const RecurrenceOptions& options);

  /// Directions weaker than this do not count: lambda is not chosen so small, and recurrences do not see them all.
  static constexpr double kLeastFelt = 1e-6;  ///< of values of AᵀA

  /// @param stated_variance  of one datum
  LambdaScan scan(std::optional<double> stated_variance) const { return joint_->scan(stated_variance, kLeastFelt); }
  Eigen::VectorXd solve(double lambda) const { return basis_ * of_data_->solve(lambda); }
  double degrees(double lambda) const { return joint_->degrees(lambda); }
  double relative_l2(double lambda) const { return of_data_->relative_l2(lambda); }

 private:
  Eigen::MatrixXd basis_;            ///< of the solutions, by column
  std::optional<Spectrum> of_data_;  ///< its bidiagonal problem
  std::optional<Spectrum> joint_;    ///< of all recurrences together
};

}  // namespace mbtfm::tractions
