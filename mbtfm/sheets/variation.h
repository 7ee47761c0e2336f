/// What a contraction that is not quite even changes of a sheet that is taken for one of even contraction.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "continuum/sheet/forward.h"
#include "mbtfm/sheets/sheet_fit.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::sheets {

/// By so much of itself the contraction of a sheet may vary over it. Beads do not show it: a sheet that pulls more at
/// its edge moves its gel as an even, softer one.
inline constexpr double kVariation = 0.2;

/// The smoothest patterns g: polynomials of second degree, orthogonal to each other and to 1. Two slopes, two saddles,
/// and the edge against the middle. Each has the root mean square kVariation/√3, with which the last is
/// kVariation (2 r²/R² − 1) on a disc.
/// @param weights  of the places: the area that each represents
/// @return places × 5
MatrixXd smooth_patterns(const std::vector<Vec2>& places_um, const VectorXd& weights);

/// How the places move (2·points × 5) if the contraction s becomes s (1 + g) of each pattern.
/// @param solution  of this scene on the ground
MatrixXd changes_by_variation_um(const sheet::OnGel& ground, const sheet::Scene& scene, const sheet::Solution& solution,
                                 const substrate::Substrate& gel, const std::vector<Vec2>& points_um);

/// "A contraction that varies by 20 % over the sheet would move the stiffness by 34 % …"; empty if that is fitted.
/// @param moved  by estimate, as add_error() has them
std::string sentence_of_variation(const std::vector<FittedEstimate>& estimates, const VectorXd& moved);

// What is known of a contraction that varies before the beads are asked.

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
