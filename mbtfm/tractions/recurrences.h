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
  int probes = 8;  ///< vectors of random signs, for the trace: it varies by some per cent
  std::uint64_t seed = 1;
};

/// |A s − u|² + lambda² |s|². One recurrence from the data gives the solution for all lambdas; the others, from random
/// signs z, give the degrees of freedom as the mean of zᵀ H z (Hutchinson; Golub & von Matt, J. Comput. Graph. Stat. 6
/// (1997) 1). All vectors are made orthogonal to those before. Traces of the data's own small problem would be those
/// of another matrix: lambda by cross-validation comes out several times too small with them.
class Recurrences {
 public:
  Recurrences(const LinearMap& map, const Eigen::VectorXd& data, const RecurrenceOptions& options);

  /// @param stated_variance  of one datum
  LambdaScan scan(std::optional<double> stated_variance) const;
  Eigen::VectorXd solve(double lambda) const { return basis_ * small_.front().solve(lambda); }
  double degrees(double lambda) const;
  double misfit(double lambda) const { return small_.front().misfit(lambda); }
  double relative_l2(double lambda) const { return small_.front().relative_l2(lambda); }

 private:
  double n_data_, n_felt_;
  Eigen::MatrixXd basis_;        ///< of the solutions, by column
  std::vector<Spectrum> small_;  ///< bidiagonal problems: of the data, then of the probes
};

}  // namespace mbtfm::tractions
