/// Whether the noise of the beads explains what a fitted sheet leaves of their displacements.
#pragma once

#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::sheets {

/// What a fit leaves, r, and how the fit follows noise: r = (1 − H) noise with H = B A⁻¹ Bᵀ, so the covariance of r is
/// that of the noise times 1 − H. If a prior is in A, this is the covariance over the prior, too.
struct Residuals {
  std::vector<Vec2> position_um;  ///< of the beads
  VectorXd weighted;              ///< r: 2·beads, over the standard error of each; 0 of beads that are not used
  VectorXd weight_per_um;         ///< 2·beads
  MatrixXd followed;              ///< B: 2·beads × what was fitted, weighted, motions included
  MatrixXd inverse;               ///< A⁻¹
  double degrees = 0;             ///< sum of the robust weights less the trace of H
  bool has_errors = false;        ///< the beads state them
};

/// A number of the residuals, and its mean and standard deviation if the model is right.
struct Statistic {
  double value = 0, expected = 0, sigma = 0;
  /// In standard deviations. @param allowed  that the beads themselves may have beyond what is expected
  double excess(double allowed = 0) const { return sigma > 0 ? (value - expected - allowed) / sigma : 0; }
};

/// χ² per degree asks how large residuals are, and needs stated errors. The correlation of near beads' residuals
/// (Moran's I of regression residuals) asks whether they are alike. It needs no errors, and shows far less of what a
/// model lacks, as that is smooth.
struct Misfit {
  Statistic chi_squared_per_degree, correlation;
  /// The larger of both. Errors of tracked beads are known to a tenth, and near beads share up to a twentieth of
  /// theirs, as their pictures overlap: three sound sheets from pictures have χ² of 1.06 to 1.18 and correlations of
  /// .01 to .04.
  double excess() const;
};

/// With K_ij = 1 for near beads, T = rᵀKr, and R = v (1 − H) + Σ l lᵀ the covariance of r:
///
///   E T = tr KR,   Var T = 2 tr KRKR,   and of χ² the same with K = 1
///
/// T is divided by v tr K², v = χ² per degree. Source: Cliff & Ord, Spatial Processes (1981), chapter 8; for Gaussian
/// noise.
/// @param near_um   beads so near are compared; more if a bead has fewer than six such neighbours in the mean
/// @param errors_um  l: 2·beads × stated errors of the model that are independent of each other, a standard error each
Misfit misfit_of(const Residuals& residuals, double near_um, const MatrixXd& errors_um);

}  // namespace mbtfm::sheets
