/// The error of the model itself. The cell's own network is one of many that its outline, adhesions and fibres allow,
/// and no mesh is it. Each adhesion's force therefore has an error e in addition to the beads' noise n,
///
///   y = C (R(t) + e) + n,   Var e_a = phi L_a,   L_a = |N_a| + 0.05 |R_a - N_a|,   Var n = s²:
///
/// in proportion to N_a, what the links of the actin network bring to the adhesion, as of a load that many links share
/// at random, and to a twentieth of what its fibres bring, whose ends spread over it. (Measured on networks of four
/// formulations, `other_network forces`: phi is the same within a half from loads of 0.03 to 2 nN.) It is not used to
/// weigh the data (what meshes show of it adds more noise than it takes away: notes/validation.md) but makes the
/// tensions' error bars.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mbtfm/tensions/linear_data.h"

namespace mbtfm::tensions {

struct ModelError {
  double least_phi_nN = 0;     ///< that of one further mesh about the mean of these: phi is no less
  double measured_phi_nN = 0;  ///< as the misfit alone has it, of the cell's network and the mean's together;
                               ///< the mean's if there are too few adhesions to determine it
  double phi_of_mean_nN = 0;   ///< what the meshes show of their mean's own
  VectorXd loads_nN;           ///< L_a, by component of the forces
  /// Variance of a single adhesion's error over phi L_a. What one adhesion lacks its neighbours have, as a rule: beads
  /// and tensions see less of that than of errors independent of each other. So do the meshes, and show by how much.
  double of_single = 1;
  VectorXd force_variance_nN2;  ///< phi L_a, by component of the forces
  /// No less than that, but of adhesions whose forces deviate more what the beads show of them (discrepancy_of): the
  /// error bars are made of it.
  VectorXd stated_variance_nN2;
  VectorXd cell_variance_nN2;  ///< of the cell's own network about the mean, as the beads show it
  double noise_variance = 0;   ///< s²: 1 where the beads' errors are as stated
  bool is_known = false;       ///< there are enough adhesions for the misfit to determine phi
  Index dimension = 2;         ///< components of a force
};

/// Of the variance of an adhesion's error: from cell to cell its logarithm scatters about the law's by 1.0 to 1.3, as
/// does that of a variance with two degrees of freedom (sqrt(trigamma(1)) = 1.28).
inline constexpr double kDegreesByAdhesion = 2;

/// Forces that one mesh gives for the tensions common to all, and their derivatives.
struct MeshForces {
  VectorXd forces_nN, network_part_nN;
  MatrixXd derivatives;
};

/// At the tensions and of the meshes that these are of.
MeshForces mean_of(const std::vector<MeshForces>& meshes);

/// A rough network has larger adhesion forces than a smooth one of the same tensions: an error e across a force R makes
/// it longer, on average by sqrt(R² + Var e) − R. What the cell's network has of this and the meshes' mean has not is
/// lacking in the sum of the magnitudes. And what nobody knows of the cell's links makes it larger, or in error.
struct RoughnessOfTotal {
  double lacking_nN = 0, surplus_nN = 0, sigma_nN = 0;
};
/// @param left  what of an error of the forces is left in those that are stated; empty: all
RoughnessOfTotal roughness_of_total(const VectorXd& forces_nN, const ModelError& error, const MatrixXd& left = {});

/// By how much errors across them of this variance (by adhesion) lengthen forces: the sum over all.
double lengthened_nN(const VectorXd& forces_nN, const VectorXd& across_nN2);
/// By adhesion the variance across its force. @param covariance  of the forces
VectorXd across_nN2(const VectorXd& forces_nN, const MatrixXd& covariance, Index dimension);

/// phi by moments: what the meshes' mean leaves of the data, the tensions following, is s² and C Var(e) Cᵀ together.
/// @param meshes  at least two
/// @param beads_variance  s²; a floor of (a thousandth of what beads move on average)² is put under it
ModelError model_error(const std::vector<MeshForces>& meshes, const ReducedData& data, double beads_variance);

/// The data in coordinates in which noise and errors of the forces together have the variance s².
/// @param data  C an upper triangle, as is that of the result
/// @param force_variance  of the errors, by component, over s²
ReducedData whitened(const ReducedData& data, const VectorXd& force_variance, int threads = 1);

// Forces that the adhesions exert besides what the network gives them: the network is a model, and where it is wrong
// the beads show it (Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001) 425). With e of model_error.h found and not only
// allowed for,
//
//   y = C (R(t) + e) + n,   Var e_a = g_a L_a,   1 / g_a ~ Gamma(ν/2, ν τ²/2),   Σ e_a = 0,  Σ x_a × e_a = 0:
//
// Student's t with ν = 4 degrees of freedom by adhesion (so heavy are the tails of networks of other formulations, and
// a fibre that was not segmented deviates at its two ends alone). g and τ² are of greatest restricted likelihood, the
// tensions being free to follow (Dempster, Laird & Rubin, J. R. Stat. Soc. B 39 (1977) 1). Where the network is right
// τ² goes to 0 and its own forces come back.

/// Sums and moments (about their middle) of forces (fx, fy) at these places: 2·places × 3.
MatrixXd balance_of(const std::vector<Vec2>& places_um);

struct Discrepancy {
  VectorXd share_nN;    ///< g_a, by adhesion
  double scale_nN = 0;  ///< τ²
  OwnForces forces;     ///< R + e given the data: no error of a tension that the data free reaches it
};

/// @param mean  of the meshes, at tensions common to all
/// @param tensions_nN  those above zero may follow, the others are held there
/// @param balance  as of the data; empty: the forces need not balance
Discrepancy discrepancy_of(const ReducedData& data, const MeshForces& mean, const VectorXd& tensions_nN,
                           const ModelError& error, const MatrixXd& balance, int threads);

/// With the variances of single adhesions that the beads show.
ModelError with_discrepancy(ModelError error, const Discrepancy& found);

}  // namespace mbtfm::tensions
