/// What is known of a contraction that varies before the beads are asked.
#pragma once

#include <cmath>

#include "pipeline/numerics/dense.h"

namespace mbtfm::sheets {

/// Of the contractions before the data: what is smooth by λ, of covariance (λL)⁻¹, and besides the smoothest patterns,
/// each of unit variance. Both together have the precision λL − λLG (1 + λGᵀLG)⁻¹ GᵀλL (Woodbury).
class ContractionPrior {
 public:
  ContractionPrior(const MatrixXd& roughness, const MatrixXd& patterns, Index n_loads)
      : rank_(static_cast<double>(roughness.rows() - 1)),  // all but an even contraction
        roughness_(MatrixXd::Zero(n_loads, n_loads)),
        of_patterns_(MatrixXd::Zero(n_loads, patterns.cols())) {
    roughness_.topLeftCorner(roughness.rows(), roughness.cols()) = roughness;
    of_patterns_.topRows(patterns.rows()) = numerics::small_product(roughness, patterns);
    among_patterns_ = numerics::small_transposed_product(patterns, of_patterns_.topRows(patterns.rows()));
  }
  double trace() const { return roughness_.trace(); }
  /// 0 of line tension and bundles.
  MatrixXd precision(double smoothing) const {
    return smoothing * roughness_ -
           numerics::small_product(smoothing * smoothing, of_patterns_,
                                   with_patterns(smoothing).solve_matrix(of_patterns_.transpose()));
  }
  double log_determinant(double smoothing) const {
    return rank_ * std::log(smoothing) - with_patterns(smoothing).log_determinant();
  }

 private:
  numerics::SmallCholesky with_patterns(double smoothing) const {
    const Index n = among_patterns_.rows();
    return numerics::SmallCholesky(MatrixXd::Identity(n, n) + smoothing * among_patterns_);
  }
  double rank_;
  MatrixXd roughness_, of_patterns_, among_patterns_;
};

}  // namespace mbtfm::sheets
