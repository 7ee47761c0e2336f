/// Forces that are not found one by one but expected to be of one size, which the beads tell: random effects of a
/// linear model, by restricted maximum likelihood (Patterson & Thompson, Biometrika 58 (1971) 545).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "substrate/ellipse.h"

namespace mbtfm::tensions {

/// Of each place the displacement by forces of 1 nN/um times the root of its area: 2·beads × 2·places.
MatrixXd by_root_of_area(MatrixXd compliance_um_per_nN, const std::vector<substrate::Ellipse>& places);

/// What the forces inside and the motions leave of the data tells of the sizes of random effects Z.
struct RandomScores {
  MatrixXd information;  ///< Zᵀ W² Z, less what forces inside and motions explain of it
  VectorXd scores;       ///< Zᵀ W² of what these leave
};
RandomScores random_scores(const LinearData& data, const MatrixXd& Z);
/// Less what the effects in these columns explain, which are of variance κ s².
/// @param scores  over s
RandomScores beside(const RandomScores& scores, const std::vector<Index>& columns, double kappa);

/// Of data with noise of variance s² and random effects of variance κ s²: those along which they do not mix.
struct Spectrum {
  VectorXd information;  ///< d: signal over noise, in squares, at κ = 1
  VectorXd found;        ///< c² / s²: its mean is d (1 + κ d)
};
/// @param scores  over s
Spectrum spectrum_of(const RandomScores& scores);
/// s²: of what the effects leave, not below the stated errors'.
/// @param spectrum  of scores that are not over s
double variance_beside(const LinearData& data, const Spectrum& spectrum);

/// −2 log likelihood of κ, but for a constant: 0 at κ = 0.
double surprise(const Spectrum& spectrum, double kappa);
/// Of least surprise, to a quarter: what is allowed for hangs on it weakly.
double likeliest_kappa(const Spectrum& spectrum);

}  // namespace mbtfm::tensions
