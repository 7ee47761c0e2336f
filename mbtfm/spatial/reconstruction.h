/// Tractions in space, with what is known of them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/spatial/loss.h"
#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "mbtfm/tractions/parameters.h"
#include "pipeline/contract/findings.h"
#include "pipeline/contract/results_in_space.h"

namespace mbtfm::spatial {

/// Tractions whose sums over parts of the surface are better than those of the map, which is smoothed or shortened for
/// the sake of its single places: a sum has less noise than these, and as much of the bias.
struct Summands {
  VectorXd traction_kPa;
  MatrixXd covariance_kPa2;
  std::optional<double> lambda;  ///< of the least expected error of the displacement, where the map has one by the risk
};

struct SpatialReconstruction {
  tractions::TractionMethod method{};
  VectorXd traction_kPa;  ///< three a vertex
  /// Of tractions: by the noise, and by what is not resolved. Empty: the method states none.
  MatrixXd covariance_kPa2;
  std::optional<Summands> summands;  ///< unset: the map's
  VectorXd resolved;                 ///< by vertex, 0 … 1: the mean share of a change of its traction that is seen
  std::optional<inverse::LambdaScan> scan;
  std::optional<double> lambda;                       ///< of |S (u − G t)|² + lambda² |s|²
  std::optional<double> length_um;                    ///< lambda times E, the same for every method
  std::optional<inverse::LambdaCriterion> lambda_by;  ///< what chose lambda in the end; none: it was given
  double degrees = 0;                                 ///< how many numbers the beads determine
  double relative_l2 = 0;                             ///< |S (u − G t)| / |S u|, weighed by the loss
  double noise_um = 0;                                ///< along the surface, as the beads have it
  double chi_squared = 0;  ///< misfit over what the stated errors leave, per datum; 0: not stated
  Weighing weighing;
  double variance = 1;       ///< of one datum as weighed, in units of sigma²
  double variance_left = 1;  ///< the same as weighed beads have it at cross-validation's lambda, whatever they state
  std::vector<PartForce> forces;                ///< by adhesion
  std::optional<double> flipped_z_chi_squared;  ///< chi_squared_of_flipped_z()
  std::string remark;
  Figures figures;
  std::vector<std::optional<Finding>> findings;
};

/// The method that the parameters name; unset group-l1 where there are adhesions, else tikhonov.
/// @throws UsageError where it takes no beads in space, or what it takes is not given
tractions::TractionMethod checked_method(const tractions::TractionParameters& traction, const SpatialInputs& inputs);

/// By checked_method().
/// @throws UsageError, InvalidData, NotSolved
SpatialReconstruction reconstruct(const Problem& problem, const SpatialInputs& inputs,
                                  const tractions::TractionParameters& traction, const SpatialParameters& parameters,
                                  int threads);

/// The minimum of |S (u − G t)|² + lambda² |x|² over the unknowns of a basis, with its loss and its lambda by the data.
/// @param response  of the beads to the unknowns
SpatialReconstruction reconstruct_in(const Basis& basis, const MatrixXd& response, const Problem& problem,
                                     const tractions::TractionParameters& traction, const SpatialParameters& parameters,
                                     int threads);

SpatialReconstruction reconstruct_patches(const Problem& problem, const tractions::TractionParameters& traction,
                                          const SpatialParameters& parameters, int threads);

/// lambda of |S (u − G t)|² + lambda² ∫ |t|² dA per um/kPa: as flat methods have it, the sum over beads approximates an
/// integral over the surface, and their weights have a mean of one.
double lambda_per_um_per_kPa(const Problem& problem);

/// Of one datum as weighed, as far as errors are stated; for a criterion of lambda. Not by the scale of the residual:
/// where lambda is too large the residual holds what moved the beads, and a noise of that size would ask for such a
/// lambda.
std::optional<double> stated_variance(const Problem& problem, BeadLoss loss, const Weighing& weighing);

struct ChosenLambda {
  double lambda = 0;
  std::optional<inverse::LambdaCriterion> by;  ///< none: given
  std::optional<Finding> finding;              ///< where it is not the criterion that was asked for
};
/// Whether the criterion `risk` can be used.
enum class RiskCriterion {
  usable,
  /// Cross-validation's lambda is taken. With a robust loss weights hang on the residuals, so that what they leave of
  /// large displacements looks like noise to the risk. With traces from random signs it divides their errors by
  /// lambda². It then smooths most tractions away.
  use_gcv
};
/// The one that is given, or by the criterion. Where the risk's is below half of the evidence's, the evidence's:
/// tractions then follow outliers, or what the model has wrong, and the risk has no minimum but the end of
/// the scan. The finding says so.
ChosenLambda choose_lambda(const Problem& problem, const inverse::LambdaScan& scan,
                           const tractions::TractionParameters& traction, RiskCriterion risk_criterion);

/// With so many tractions that the problem has no matrix: without standard errors.
SpatialReconstruction reconstruct_tikhonov(const Problem& problem, const tractions::TractionParameters& traction,
                                           const SpatialParameters& parameters, int threads);

/// By vertex: the mean over its components of the diagonal of I − C Q, C the covariance of the tractions with what was
/// known before, Q the inverse of the latter alone, the same for each component.
VectorXd resolved_shares(const MatrixXd& covariance, const MatrixXd& precision_before);

SpatialReconstruction reconstruct_group_l1(const Problem& problem, const tractions::TractionParameters& traction,
                                           const SpatialParameters& parameters, int threads);

/// The equations of tikhonov by conjugate gradients, each step a solution of the gel and one of its adjoint, which is
/// the gel itself (Ambrosi, SIAM J. Appl. Math. 66 (2006) 2049, with tractions on a surface).
SpatialReconstruction reconstruct_adjoint(const Problem& problem, const tractions::TractionParameters& traction,
                                          const SpatialParameters& parameters, int threads);
/// The minimum of tikhonov's functional by Fletcher and Reeves, as the thesis. It reports what differences would cost.
SpatialReconstruction reconstruct_thesis_cg(const Problem& problem, const tractions::TractionParameters& traction,
                                            const SpatialParameters& parameters, int threads);
/// The displacement measured, interpolated from the nearest beads, is imposed on the surface (Hur et al., Cell. Mol.
/// Bioeng. 2 (2009) 425). No regularisation: it shows what noise does then.
SpatialReconstruction reconstruct_direct(const Problem& problem, int threads);
/// Even tractions on the faces (Legant et al., Nat. Methods 7 (2010) 969), with tikhonov's lambda.
SpatialReconstruction reconstruct_green(const Problem& problem, const tractions::TractionParameters& traction,
                                        const SpatialParameters& parameters, int threads);

/// Forces on the adhesions with a background that is only known to be weak: what the beads say of an even load on
/// each, least squares with the background's displacement as a part of the noise. Smoothing takes nothing from them,
/// and their errors hold noise and background. Where the surface carries more than these adhesions do, it is in the
/// errors only as far as it is as weak as lambda says.
///
///   f = (PᵀWP)⁻¹ PᵀW u,  cov f = (PᵀWP)⁻¹,  W⁻¹ = v (I + A Aᵀ/lambda²)
///
/// u, A and P weighed by S: the displacement, what it answers to the background's unknowns and to the forces; v the
/// variance of a datum. Source: generalised least squares (Aitken 1936), with (I + A Aᵀ/lambda²)⁻¹ =
/// I − A (AᵀA + lambda²)⁻¹ Aᵀ.
/// @param background  of the beads to the unknowns of the background, |x|² their norm
/// @param reconstruction  with its lambda, weights and variance
std::vector<PartForce> forces_beside_background(const Problem& problem, const MatrixXd& background,
                                                const SpatialReconstruction& reconstruction, int threads);

/// By how much chi-squared of the beads and of the tractions' prior is larger if all displacements along z have the
/// opposite sign; below zero: that sign explains the beads better. None where no displacement along z counts.
///
///   chi² = |S u|²/variance − (Gᵀ S² u)ᵀ C (Gᵀ S² u)/variance²
std::optional<double> chi_squared_of_flipped_z(const Problem& problem, const SpatialReconstruction& r);

/// What forces, moments and their errors are sums of.
const VectorXd& summed_tractions_kPa(const SpatialReconstruction& reconstruction);
const MatrixXd& covariance_of_summed_kPa2(const SpatialReconstruction& reconstruction);

/// The forces of the tractions to be summed, and their errors where the reconstruction has a covariance.
std::vector<PartForce> forces_on(const Problem& problem, const SpatialReconstruction& reconstruction,
                                 const MatrixXd& areas_um2);

/// Sums over the surface.
struct Balance {
  Vec3 force_nN, force_sigma_nN;
  Vec3 moment_nN_um, moment_sigma_nN_um;                      ///< about `centre_um`
  double net_force_sigma_nN = 0, net_moment_sigma_nN_um = 0;  ///< along themselves
  /// Squared distance of net force and net moment from none, in their joint standard errors: of a cell in balance
  /// chi-squared with six degrees of freedom. Unset: no errors are known.
  std::optional<double> imbalance;
  Vec3 centre_um;
  double total_force_nN = 0;        ///< ∫ |t| dA
  double total_force_sigma_nN = 0;  ///< by noise, and by what smoothing takes and noise adds
  double normal_force_nN = 0;       ///< ∫ |t . n| dA
  double strain_energy_fJ = 0;
  /// −∫ (x − centre) . t dA, above zero where the cell contracts, with its standard error (Butler et al., Am. J.
  /// Physiol. Cell Physiol. 282 (2002) C595, with the third direction).
  double contractile_moment_nN_um = 0, contractile_moment_sigma_nN_um = 0;
};
Balance balance_of(const Problem& problem, const SpatialReconstruction& reconstruction);
/// Where its errors are known.
std::optional<Finding> noticed_imbalance(const Balance& balance);

/// Forces closer together than this look like one; from about twice that on they are mostly seen as two
/// (notes/planning.md). The side of the area over which the beads determine one number for
/// each component.
std::vector<double> resolution_um(const Problem& problem, const SpatialReconstruction& reconstruction);

}  // namespace mbtfm::spatial
