/// A linear problem in the frame of its own directions: every lambda at once.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "mbtfm/inverse/regularisation.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::inverse {

/// Directions in which the risk looks for a signal.
enum class SignalIn {
  felt,     ///< all that move the data: (15)
  resolved  ///< those that the data distinguish from noise: (15b)
};

/// |A s − u|² + lambda² |s|², from AᵀA and Aᵀu. Values of AᵀA below 1e-12 of the largest are rounding, and none here.
class Spectrum {
 public:
  /// @param normal   AᵀA; what is below its diagonal does not count
  /// @param adjoint  Aᵀu
  Spectrum(MatrixXd normal, const VectorXd& adjoint, double data_squared, double n_data);
  /// Data whose squares, and those of Aᵀu by direction, are what they are in the mean with white noise added: criteria
  /// then are what they are expected to be. Of solve() nothing holds but the size.
  /// @param variance  of one datum
  Spectrum with_noise(double variance) const;

  /// @param stated_variance  of one datum
  LambdaScan scan(std::optional<double> stated_variance, SignalIn signal_in) const;
  /// Of one datum, of the half of the directions that is felt least, where it is larger than noise alone would have it
  /// besides what no s can follow: there is an error of A itself then, which s can follow, and which no criterion with
  /// white noise knows. None where they agree, or no data are left beside. Where a signal reaches so far down it is
  /// taken for such an error, and lambda is too large.
  std::optional<double> variance_felt_least() const;
  VectorXd solve(double lambda) const;
  /// (AᵀA + lambda²)⁻¹ (Aᵀu + added)
  VectorXd solve(double lambda, const VectorXd& added) const;
  /// Of solve(lambda), by the noise alone. @param variance  of one datum
  MatrixXd covariance(double lambda, double variance) const;
  /// Of s itself, where nothing but its size was known before: noise and what the penalty takes away.
  MatrixXd posterior(double lambda, double variance) const;
  /// By unknown: variance of what solve(lambda) errs by. @param prior_variance  of each unknown before the data
  VectorXd error_variances(double lambda, double variance, double prior_variance) const;
  double explained(double lambda) const;         ///< uᵀ H u, H the matrix that takes u to A s
  double misfit(double lambda) const;            ///< |u − A s|² of solve(lambda)
  double misfit_of(const VectorXd& s) const;     ///< the same of any s
  double removable_misfit(double lambda) const;  ///< the part of it that another s could remove
  double degrees(double lambda) const;           ///< trace of the matrix that takes u to A s
  double relative_l2(double lambda) const;       ///< |u − A s| / |u|
  double data_squared() const { return data_squared_; }

  /// V with AᵀA = V diag Vᵀ
  const MatrixXd& vectors() const { return *vectors_; }
  const Eigen::ArrayXd& values() const { return values_; }

 private:
  friend class Recurrences;
  /// Down to this part of the largest singular value. @param degrees, n_felt  of the whole problem
  LambdaScan scan(double smallest_part, const std::function<double(double lambda)>& degrees, double n_felt,
                  std::optional<double> stated_variance, SignalIn signal_in) const;
  double misfit_in_frame(const Eigen::ArrayXd& shares) const;
  MatrixXd outer(const Eigen::ArrayXd& shares) const;
  /// Directions that the data distinguish from noise. @param variance  of one datum
  Eigen::Array<bool, Eigen::Dynamic, 1> is_resolved(double variance) const;
  std::vector<double> risks_of_resolved(const std::vector<ScanPoint>& points, double variance) const;  ///< (15b)
  double data_squared_, n_data_;
  Eigen::ArrayXd values_, projected_;
  std::shared_ptr<const MatrixXd> vectors_;
};

Spectrum spectrum_of(const MatrixXd& A, const VectorXd& u, double n_data, int threads);

// Every lambda of a linear problem whose matrix is never formed: Golub–Kahan recurrences side by side.

/// A and Aᵀ on columns; many at a time cost hardly more than one.
struct LinearMap {
  std::function<MatrixXd(const MatrixXd&)> forward, transposed;
  Index n_data = 0, n_unknowns = 0;
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
  Recurrences(const LinearMap& map, const VectorXd& data, const RecurrenceOptions& options);

  /// @param stated_variance  of one datum
  LambdaScan scan(std::optional<double> stated_variance) const;
  VectorXd solve(double lambda) const { return basis_ * small_.front().solve(lambda); }
  double degrees(double lambda) const;
  double misfit(double lambda) const { return small_.front().misfit(lambda); }
  double relative_l2(double lambda) const { return small_.front().relative_l2(lambda); }

 private:
  double n_felt_;
  MatrixXd basis_;               ///< of the solutions, by column
  std::vector<Spectrum> small_;  ///< bidiagonal problems: of the data, then of the probes
};

}  // namespace mbtfm::inverse
