/// Means of groups whose observations are not independent: those of one cell share what the cell has of its own, and
/// each is measured with an error of known size. Restricted maximum likelihood.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace mbtfm::statistics {

/// One fibre, adhesion or cell. All indices from 0.
struct Observation {
  double value = 0;
  double error_variance = 0;  ///< of its measurement, known
  int cell = 0;
  int kind = 0;   ///< fibre type, or connected or not: kinds differ in their scatter, and in their own way in each cell
  int group = 0;  ///< whose mean is asked for: a kind under a condition
  int id = 0;     ///< of the fibre or adhesion, for people; 0: of the cell
};

/// y = mean(group) + a(cell) + b(cell, kind) + e(kind) + measurement error, all normal and independent, with the
/// variances of a, b and of e by kind unknown. a is left out where no cell has two observations, b where no cell has
/// two kinds or no kind two observations in a cell: it would not be identifiable. Both are left out where no
/// group has two cells: the groups' means take up all that cells differ by.
struct MixedFit {
  Eigen::VectorXd mean = {};                 ///< by group
  Eigen::MatrixXd covariance;                ///< of the means
  std::optional<double> cell_variance;       ///< of a; none where a is left out
  std::optional<double> cell_kind_variance;  ///< of b; none where b is left out
  /// of e, by kind; none of a kind that has no two observations in any group
  std::vector<std::optional<double>> residual_variance;
  double log_likelihood = 0;  ///< restricted
  int n_cells = 0, n_observations = 0;
  bool converged = false;
  // for Satterthwaite's degrees of freedom
  std::vector<Eigen::MatrixXd> covariance_slopes;  ///< of `covariance` by each variance that is not zero; may be none
  Eigen::MatrixXd variance_covariance;             ///< of the estimates of these variances
};

/// Average-information REML (Gilmour, Thompson & Cullis, Biometrics 51, 1440 (1995)) with the known error variances on
/// the diagonal; variances are held at zero where the likelihood falls on leaving it.
/// @throws InvalidData for fewer than two cells, a group without observations, values that are all equal, or that
/// differ neither within a group nor by errors
MixedFit fit_mixed_model(std::vector<Observation> observations);

/// A weighted sum of the group means, with Student's t at Satterthwaite's degrees of freedom.
struct Contrast {
  double estimate = 0, standard_error = 0, degrees = 0;
  double t = 0, p_value = 1;
  double low = 0, high = 0;  ///< 95 %
};
/// @param degrees  of freedom of the standard error
Contrast by_students_t(double estimate, double standard_error, double degrees);
/// Source of the degrees: Giesbrecht & Burns, Biometrics 41, 477 (1985).
Contrast contrast_of(const MixedFit& fit, const Eigen::VectorXd& weights);
/// The interval of a mean that cannot be negative: Student's on the scale of its logarithm, whose standard error is the
/// relative one. As it is, from zero on, where the estimate is not positive.
/// Source: Meeker & Escobar, Statistical Methods for Reliability Data (1998), intervals of positive parameters.
Contrast with_positive_interval(Contrast mean);

struct FTest {
  double f = 0, numerator_degrees = 0, denominator_degrees = 0, p_value = 1;
};
/// Are all rows' contrasts zero? Source of the degrees: Fai & Cornelius, J. Stat. Comput. Simul. 54, 363 (1996).
FTest test_all_zero(const MixedFit& fit, const Eigen::MatrixXd& contrasts);

}  // namespace mbtfm::statistics
