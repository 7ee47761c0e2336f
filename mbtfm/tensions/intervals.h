/// How far the tensions may lie from the best ones, as the beads show on one mesh.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mbtfm/tensions/tension_fit.h"

namespace mbtfm::tensions {

inline constexpr double kNormal95 = 1.959963984540054;  ///< two-sided 95 % of a normal variable

/// Around a solution t: 2 Phi(t + s) ≈ 2 Phi(t) + 2 gᵀ s + sᵀ H s, in units of a variance (see misfit_variance). By the
/// noise alone g has that variance times H.
struct LocalMisfit {
  VectorXd tensions_nN;
  MatrixXd H;                    ///< Jᵀ J
  VectorXd g;                    ///< Jᵀ r
  MatrixXd model_variance = {};  ///< of g by the error of the model, besides that of the noise; empty: none
};
LocalMisfit local_misfit(const Trial& trial, const MatrixXd& jacobian);

/// K = H⁻¹: how the tensions follow −g. Those that the data press against zero by three standard errors or more are
/// held: they do not move, and the others as without them; by one or less they are free. Between, they pass from the
/// one to the other smoothly, so that nothing jumps where the data change by rounding. A direction that no bead
/// constrains moves far.
MatrixXd response_of(const LocalMisfit& local, double variance);

/// K Var(g) K: of both errors (the sandwich; White, Econometrica 50 (1982) 1).
MatrixXd covariance_nN2(const LocalMisfit& local, double variance);

/// From the solution to where the misfit would be least without the bounds. Estimates that end at a bound are biased
/// towards the inside, and those of other tensions with them; sums over many tensions are not where each is counted
/// from there (without bounds least squares are unbiased). Tensions that more than chance presses against zero (two
/// standard errors; none by four) stay there.
VectorXd past_bounds_nN(const LocalMisfit& local, double variance);

/// Mean error of the tensions by the bending of forces that are not linear in them (Box, J. R. Stat. Soc. B 33 (1971)
/// 171): two equilibria for each tension, a standard error up and down along uncorrelated directions of them.
/// @param response, covariance_nN2  as response_of() and covariance_nN2() have them
VectorXd bending_bias_nN(const TensionProblem& problem, const Trial& solution, const MatrixXd& jacobian,
                         const MatrixXd& response, const MatrixXd& covariance_nN2, int threads);

/// By how much noise makes the sum of the forces' magnitudes too large, to second order: an error across a force F
/// lengthens it by its square over 2 F.
/// @param forces_nN  by adhesion: fx, fy
/// @param derivatives  of the forces, by tension
double magnitude_bias_nN(const VectorXd& forces_nN, const MatrixXd& derivatives, const MatrixXd& covariance_nN2,
                         Index dimension = 2);

/// Distance to either end of an interval.
struct Sides {
  double below = 0, above = 0;
};
/// 95 % interval of each tension: where the least misfit over all other tensions >= 0 has risen by 1.96² variances.
/// Ends at a bound; where no tension meets one on the way it is 1.96 standard errors to either side (profile
/// likelihood; Venzon & Moolgavkar, Appl. Statist. 37 (1988) 87, on the local misfit). With an error of the model the
/// rise is that which makes this so again (Chandler & Bate, Biometrika 94 (2007) 167). Continuous in the misfit.
/// Infinite above where no bead feels a tension.
std::vector<Sides> profiles_95(const LocalMisfit& local, double variance);

/// Parametric bootstrap: fits to displacements that the solution gives, with noise of this variance redrawn, less
/// the solution. One column a draw; the draws' random numbers follow from their index.
/// @param force_variance_nN2  of the model's error, drawn too; empty: none
MatrixXd bootstrap_deviations_nN(const TensionProblem& problem, const FitParameters& parameters, const Trial& solution,
                                 double variance, const VectorXd& force_variance_nN2,
                                 const std::vector<std::uint64_t>& draws, int threads);
/// Ends of the middle 95 % of the draws.
Sides percentiles_95(std::vector<double> deviations);

}  // namespace mbtfm::tensions
