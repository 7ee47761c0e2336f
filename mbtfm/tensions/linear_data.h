/// The bead displacements as the fit sees them: linear in the adhesion forces, so all beads reduce to one small matrix.
/// Comments say 2· for the components of a force or a bead's displacement, as in the plane. In space these are 3
/// (`dimension`), and tensions, their intervals, forces and their errors are found the same way.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/geometry.h"
#include "substrate/response.h"

namespace mbtfm::tensions {

/// Of so many components as `dimension` has: a force, a displacement, a way; and what maps one to another.
using ShortVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;
using ShortMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

/// |W (G R − u)|² = |C R − y|² + floor² for every force vector R, where motions are allowed for at their best (and what
/// is expected of their sizes counts: aᵀΛa is part of the left side).
/// White noise of W u is white in y.
struct ReducedData {
  std::shared_ptr<const MatrixXd> compliance;  ///< C: 2·adhesions × 2·adhesions; shared, as it may be large
  VectorXd target;                             ///< y: 2·adhesions
  double floor_squared = 0;                    ///< what no force can explain
  Index n_components = 0;                      ///< of the beads' displacements that it represents
  Index n_felt = 0;                            ///< directions of the forces that any bead feels
  bool is_upper = false;                       ///< C is an upper triangle
  Index dimension = 2;                         ///< components of a force
};
/// C F: 2·adhesions × any number
MatrixXd displace(const ReducedData& data, const MatrixXd& forces_nN, int threads = 1);

/// What the beads may do besides following the forces: sums of some shapes, of sizes that are found with these.
struct Motions {
  MatrixXd shapes = {};     ///< M: 2·beads × motions
  VectorXd precision = {};  ///< Λ, diagonal: by motion, the inverse of the variance that is expected of its size, in
                            ///< units of the noise's; 0 where nothing is known of it; empty: all 0
  MatrixXd inverse = {};    ///< (MᵀW²M + Λ)⁻¹, by rank: of beads in one place a turn is a shift. The covariance
                            ///< of the sizes by noise of variance 1
  MatrixXd forces = {};     ///< E: by motion, the forces of adhesions that it comes of, besides those found as forces;
                            ///< 2·adhesions × motions; empty: none
};

/// Both together: each stays what it is.
Motions joined(Motions those, const Motions& these);
/// The same, ahead of the last of those.
Motions joined_ahead(const Motions& those, Index n_last, const Motions& these);

struct LinearData {
  std::vector<Vec2> position_um;       ///< of the beads
  std::vector<double> height_um = {};  ///< of the beads, in space; empty: all alike
  std::vector<double> held_um = {};    ///< height at which each adhesion is pulled at, in space; empty: 0
  substrate::SharedResponse response;  ///< G: 2·beads × 2·adhesions, rows 2i, 2i+1 of bead i
  MatrixXd balance;          ///< 2·adhesions × sums that are zero where all forces balance; empty: not known
  VectorXd displacement_um;  ///< u: 2·beads, in the same order, less the offset
  VectorXd offset_um;        ///< of a gel that is not linear: G F + offset moves its beads; empty: 0
  VectorXd weight_per_um;    ///< W, diagonal, 2·beads: 1/sigma; 0 where the bead is not used
  VectorXd bead_weight;      ///< by bead, 0 … 1: what a robust loss leaves of W²
  Motions motions;
  Index n_used = 0;         ///< components of the beads that are used, less one for each motion of precision 0
  bool has_errors = false;  ///< the beads state their sigma; without, W is 1 and the misfit gives the error
  int threads = 1;          ///< to reduce it with
  Index dimension = 2;      ///< components of a force, and of a bead's displacement
  ReducedData reduced;      ///< of all that, bead_weight included
};

/// In space, z into the gel.
Vec3 place_of_bead(const LinearData& data, Index bead);
std::vector<Vec3> places_of_beads(const LinearData& data);

/// @param beads  all with sigma_um > 0, or weights are the same for all
/// @param response  2·beads × 2·adhesions
/// @param is_used  by bead; empty: all
LinearData reduce(const DisplacementField& beads, substrate::SharedResponse response,
                  const std::vector<bool>& is_used = {}, int threads = 1, MatrixXd motions = {});
/// The same with the matrix of the response.
LinearData reduce(const DisplacementField& beads, MatrixXd compliance_um_per_nN, const std::vector<bool>& is_used = {});

// New data of the same beads. Who moves the old ones in has no two matrices in memory.

/// The beads may move by any sum of these besides, instead of those that were allowed. Reduces again.
LinearData with_motions(LinearData data, Motions motions);
/// They may move by any sum of these shapes too, of precision 0: quicker.
LinearData with_more_motions(LinearData data, const MatrixXd& motions);
/// Reduced again with these weights by bead.
LinearData reweighted(LinearData data, const VectorXd& bead_weight);
/// Without what a robust loss has made of the weights.
LinearData unweighted(LinearData data);

/// With another response of the same size. Without what a robust loss has made of the weights.
LinearData with_response(LinearData data, substrate::SharedResponse response);
/// Of a gel that is not linear: it moves the beads by response · F + offset_um near the forces that are found. Without
/// what a robust loss has made of the weights.
/// @param measured_um  of the beads, 2·beads
LinearData about_forces(LinearData data, substrate::SharedResponse response, const VectorXd& measured_um,
                        VectorXd offset_um);
/// What forces make of the beads: G F and the offset; um, 2·beads.
VectorXd moved_by(const LinearData& data, const VectorXd& forces_nN);

/// How much of each motion explains these displacements (2·beads × some) best, as the beads are weighed and the motions
/// expected: (MᵀW²M + Λ)⁻¹ MᵀW² D
MatrixXd motion_in(const LinearData& data, const MatrixXd& displacements);
/// Forces that adhesions have of their own, E a added to R: the a that explain best what R leaves. Linear in R, so
/// R + E a = left · R + found, and what the beads' noise makes of a given R is covariance times its variance.
struct OwnForces {
  MatrixXd left;        ///< 1 − E (MᵀW²M + Λ)⁻¹ MᵀW²G: 2·adhesions square
  VectorXd found_nN;    ///< E (MᵀW²M + Λ)⁻¹ MᵀW²u: 2·adhesions
  MatrixXd covariance;  ///< E (MᵀW²M + Λ)⁻¹ Eᵀ: 2·adhesions square
};
/// None where no motion comes of them.
std::optional<OwnForces> own_forces_in(const LinearData& data);

/// What no motion explains of these displacements: P D, P = 1 − M (MᵀW²M + Λ)⁻¹ MᵀW². With Λ, W²P is the inverse of the
/// covariance W⁻² + M Λ⁻¹ Mᵀ of noise and motions together.
MatrixXd less_motion(const LinearData& data, MatrixXd displacements);
/// What forces and motions leave: P (u − G R), um, 2·beads.
VectorXd residual_um(const LinearData& data, const VectorXd& forces_nN);
/// The same with each component over its standard error, times that along x: microscopes see worse along z.
VectorXd evened_residual_um(const LinearData& data, const VectorXd& forces_nN);
/// Whether the bead counts at all.
bool is_used(const LinearData& data, Index bead);

/// W² and the weights by bead: 2·beads.
VectorXd squared_weights(const LinearData& data);

/// Forces independent of each other that explain the beads best: C⁻¹ y, 2·adhesions.
/// @param reduced  of reduce(), as for the next one
VectorXd free_forces_nN(const ReducedData& reduced);
/// (CᵀC)⁻¹ X, both 2·adhesions × any number
MatrixXd solve_normal(const ReducedData& reduced, MatrixXd X);

/// Answers to the displacements of the beads, M Gᵀ W², some rows at a time: a whole is too large for large scenes.
class BeadAnswers {
 public:
  /// @param by_force  M: any number × 2·adhesions
  BeadAnswers(const LinearData& data, MatrixXd by_force);
  Index n_rows() const { return by_force_.rows(); }
  /// Calls body(first, block) with rows first, first + 1, … of the answers: some × 2·beads.
  void for_each_block(const std::function<void(Index first, const MatrixXd& block)>& body) const;

 private:
  const LinearData& data_;
  MatrixXd by_force_;
};

/// Sum of the magnitudes of forces (fx, fy by adhesion).
double total_nN(const VectorXd& forces_nN, Index dimension = 2);

/// residual_um, times W: 2·beads
VectorXd weighted_residual(const LinearData& data, const VectorXd& forces_nN);

/// What forces make of these displacements (um, 2·beads) in place of the data's: target and floor_squared of them as
/// `reduced` has them.
struct Explained {
  VectorXd target;           ///< y = C⁻ᵀ Gᵀ W² P u
  double floor_squared = 0;  ///< uᵀ W² P u − |y|², Λ included
};
Explained explained(const LinearData& data, const VectorXd& displacement_um);

/// Variance of a weighted component that is the beads' alone: what even forces independent of each other leave. Not
/// below the stated errors'.
double noise_variance(const LinearData& data);

/// A model and what speaks for it. chi² and the criteria are in units of the noise: the beads' stated errors, or larger
/// ones where even independent adhesion forces leave more than these (Burnham & Anderson 2002, 2.5: QAIC).
struct ModelScore {
  std::string name;
  int n_parameters = 0;
  double chi_squared = 0, relative_l2 = 0;
  double aic = 0;  ///< chi² + 2 k
  double bic = 0;  ///< chi² + k ln n
  /// BIC where the model's own error is allowed for, and its size by component of a force: see evidence.h
  double bic_with_discrepancy = 0, discrepancy_nN = 0;
  VectorXd forces_nN = {};  ///< by adhesion: fx, fy
  VectorXd left_um = {};    ///< of the beads' displacement; empty: all of it, as each force is an error of its own
};
/// @param chi_squared  of the data
ModelScore score_of(const std::string& name, Index n_parameters, double chi_squared, double relative_l2,
                    const LinearData& data);

/// |residual| / |u less the common motion| over the beads that are used
double relative_l2(const LinearData& data, const VectorXd& forces_nN);

}  // namespace mbtfm::tensions
