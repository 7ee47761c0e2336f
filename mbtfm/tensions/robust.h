/// Robust losses (thesis 2.3.2): sum of rho(|r_b| / s) over beads b instead of the sum of squares, so that a few bad
/// beads cannot pull the tensions away. By iterative reweighting: w(r) = rho'(r) / r.
#pragma once

#include <optional>
#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_fit.h"

namespace mbtfm::tensions {

/// Columns of dR/dt (2·adhesions × tensions) of the tensions that are not at their bound, zero.
MatrixXd of_free_tensions(const MatrixXd& force_derivatives, const VectorXd& tensions_nN);

/// The weighted residuals of a trial, each made as large as if the fit did not follow its bead: (1 − H)^(−1/2) r, H the
/// bead's 2 × 2 block of the hat matrix of motions and tensions, those at zero held there (Cook & Weisberg, Residuals
/// and Influence in Regression, 1982, 2.2). Beside an adhesion a single bead may tell half of its force.
struct Studentized {
  VectorXd residual;  ///< 2·beads
  VectorXd leverage;  ///< by bead: trace of H; they add up to the number of unknowns
};
/// @param force_derivatives  dR/dt: 2·adhesions × tensions
Studentized studentized(const LinearData& data, const Trial& trial, const MatrixXd& force_derivatives);

/// Beads whose residuals Gaussian noise has in less than one case in twenty, exp(−r²/2) < 0.05 q (Rayleigh, r in robust
/// standard deviations), and that stand alone: the nearest bead does not go along by half. The chance q that a bead is
/// given adds up to 1: half goes to all alike, half by leverage, as a bead that the fit follows can do more harm
/// (weighted Bonferroni: Genovese, Roeder & Wasserman, Biometrika 93:509, 2006). None where most of the large ones go
/// along: then the model and not the beads are wrong there, and to discount them would explain the still part of the
/// gel only.
std::vector<Index> stray_beads(const LinearData& data, const Studentized& beads);

/// What these beads do to the fit by least squares, in standard errors: by how many the tension moves most that does if
/// they lose all their weight (the forces taken as linear in the tensions), or by what share they widen all of them,
/// the larger. One of two hundred thousand beads moves none; but one that is micrometres off widens them from anywhere.
/// @param force_derivatives  dR/dt: 2·adhesions × tensions
double harm_done_by(const std::vector<Index>& strays, const LinearData& data, const VectorXd& weighted_residual,
                    const MatrixXd& force_derivatives);

/// Weight of a bead whose residual has this size, in robust standard deviations; 1 at zero (l1: large there).
/// squares 1 | huber min(1, k/r), k = 1.500 | tukey (1 − (r/c)²)², c = 5.123 | l1 1/r.
/// k and c keep 95 % efficiency where the noise is Gaussian in the plane (Maronna, Martin & Yohai, Robust Statistics,
/// 2006, 6.4, solved for two dimensions); l1 keeps 79 %. A bead's residual is a vector: the weight follows its length,
/// so that nothing depends on the axes.
double robust_weight(Loss loss, double residual);

/// By bead, of its residual. @param residual  2·beads  @param scale  standard deviation of a component
VectorXd robust_weights(Loss loss, const VectorXd& residual, double scale);

/// Standard deviation of a component that the middle of the residuals tells: median of |r_b| / 1.1774 (Rayleigh).
double robust_scale(const LinearData& data, const VectorXd& weighted_residual);

/// The last fit, and the data with the weights that it was made with.
struct WeighedFit {
  TensionFit fit;
  LinearData data;
};
/// Weigh the beads by the residuals of a fit, fit on this network again, until the tensions stay. Tukey's loss, which
/// has several minima, starts from Huber's.
/// @param loss  all but squares
/// @param first  the fit by least squares
WeighedFit fit_reweighted(LinearData data, const network::Contractile& network, const std::vector<int>& adhesion_ids,
                          const FitParameters& parameters, Loss loss, int threads, TensionFit first);

/// The factor on (Jᵀ Cᵀ C J)⁻¹ that makes it the covariance. Squares: chi² per degree of freedom, but not below 1 where
/// the beads state their errors; else the same from the asymptotic variance of the loss (Maronna et al., 10.3):
/// s² E(psi²/2) E(w) / E((psi' + psi/r)/2)², E the mean over the beads.
double misfit_variance(const LinearData& data, const VectorXd& forces_nN, Index n_tensions, Loss loss);

}  // namespace mbtfm::tensions
