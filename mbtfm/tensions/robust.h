/// Tensions by a robust loss (thesis 2.3.2): by iterative reweighting. See mbtfm/inverse/loss.h.
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
/// and Influence in Regression, 1982, 2.2). A single bead near an adhesion may determine half of its force.
struct Studentized {
  VectorXd residual;  ///< 2·beads
  VectorXd leverage;  ///< by bead: trace of H; they add up to the number of unknowns
};
/// @param force_derivatives  dR/dt: 2·adhesions × tensions
Studentized studentized(const LinearData& data, const Trial& trial, const MatrixXd& force_derivatives);

/// Beads whose residuals Gaussian noise has in less than one case in twenty, exp(−r²/2) < 0.05 q (Rayleigh, r in robust
/// standard deviations), and that are alone: the nearest bead does not go along by half. The chance q that a bead is
/// given adds up to 1: half goes to all alike, half by leverage, as a bead that the fit follows can do more harm
/// (weighted Bonferroni: Genovese, Roeder & Wasserman, Biometrika 93:509, 2006). None where most of the large ones go
/// along: then the model and not the beads are wrong there, and to discount them would explain the still part of the
/// gel only.
std::vector<Index> stray_beads(const LinearData& data, const Studentized& beads);

/// All beads in full but the strays of this trial, which are left out.
/// @param motions  that follow a bead as the tensions do, in addition to the data's; empty: none
LinearData without_strays(LinearData data, const Trial& trial, const MatrixXd& force_derivatives,
                          const MatrixXd& motions = {});

/// What these beads do to the fit by least squares, in standard errors: by how many the tension moves most that does if
/// they lose all their weight (the forces taken as linear in the tensions), or by what share they widen all of them,
/// the larger. One of two hundred thousand beads moves none; but one that is micrometres off widens them from anywhere.
/// @param force_derivatives  dR/dt: 2·adhesions × tensions
double harm_done_by(const std::vector<Index>& strays, const LinearData& data, const VectorXd& weighted_residual,
                    const MatrixXd& force_derivatives);

/// inverse::scale_of() of the beads in use.
double robust_scale(const LinearData& data, const VectorXd& weighted_residual);

/// The last fit, and the data with the weights that it was made with.
struct WeighedFit {
  TensionFit fit;
  LinearData data;
};
/// Weigh the beads by the residuals of a fit, fit on this network again, until the tensions stay. Tukey's loss keeps
/// the scale of Huber's, at whose fit it begins.
/// @param loss  all but squares
/// @param first  the fit by least squares
WeighedFit fit_reweighted(LinearData data, const network::Contractile& network, const std::vector<int>& adhesion_ids,
                          const FitParameters& parameters, Loss loss, int threads, TensionFit first);

/// The factor on (Jᵀ Cᵀ C J)⁻¹ that makes it the covariance. Squares: chi² per degree of freedom, but not below 1 where
/// the beads state their errors; else the same from inverse::estimator_of().
double misfit_variance(const LinearData& data, const VectorXd& forces_nN, Index n_tensions, Loss loss);

}  // namespace mbtfm::tensions
