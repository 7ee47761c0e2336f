/// The fit on an ensemble of networks: the mesh is part of the model and its largest hidden error
/// (docs/theory/network.md), so every reported tension is the mean over independent meshes, and their spread is part of
/// its error bar.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tensions/edge_forces.h"
#include "mbtfm/tensions/intervals.h"
#include "mbtfm/tensions/model_error.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/work.h"

namespace mbtfm::tensions {

/// An estimate with its standard error.
struct Estimate {
  double value = 0;
  double noise = 0;           ///< from the beads
  double standard_error = 0;  ///< from the beads and the error of the model; noise, where there is but one mesh
  double degrees = 1e6;       ///< of freedom that the standard error has: few where few adhesions' errors make it
  std::optional<Sides> sides_95 = {};  ///< of the 95 % interval, but for the degrees; none: 1.96 times the error
  /// The part of the standard error that is the model's.
  double from_model() const { return std::sqrt(std::max(0.0, standard_error * standard_error - noise * noise)); }
};

/// What one mesh says.
struct MeshFit {
  TensionFit fit;
  MatrixXd force_derivatives;  ///< dR/dt at the solution
  LocalMisfit local;
  MatrixXd response;                          ///< of the tensions to −Jᵀ r, as response_of() has it
  MatrixXd by_force;                          ///< what an error of each force makes of the tensions
  MatrixXd covariance_nN2;                    ///< of the tensions, from noise and model
  MatrixXd noise_covariance_nN2;              ///< of the tensions, from the beads' noise
  VectorXd past_bounds_nN;                    ///< from the tensions to the unbounded minimum
  std::vector<Sides> intervals_95;            ///< of the tensions, from noise and model
  VectorXd network_forces_nN, torques_nN_um;  ///< by adhesion; see EnsembleFit
  CutReaction cut;
  VectorXd network_part_nN;  ///< of the forces: what the links of the actin network bring
};

/// The force that passes through the cut: the part of the cell that is seen pulls the unseen one with it, and so much
/// do the adhesions out there exert on the gel together. Mean over the meshes.
struct CutForce {
  CutReaction reaction;               ///< the network's; the others hold the adhesions' own forces, too
  Estimate x_nN, y_nN, magnitude_nN;  ///< magnitude: along direction()
  Eigen::Vector2d direction() const;  ///< of length 1
};

/// The tensions, the actin network's first.
struct FoundTensions {
  std::vector<int> fibre_ids;  ///< front() is 0, the actin network
  std::vector<Estimate> nN;
  MatrixXd covariance_nN2;  ///< mean over the meshes
  double network_bias = 0;  ///< of the network's, relative: by forces that bend within its error
};

/// What the adhesions carry, fx and fy by adhesion; means over the meshes.
struct FoundForces {
  VectorXd nN;                       ///< of the network
  std::optional<OwnForces> own;      ///< that adhesions have in addition, near a cut and where the network is wrong
  VectorXd torques_nN_um;            ///< by adhesion, about the origin
  std::vector<Estimate> magnitudes;  ///< by adhesion
  VectorXd of_network_nN;            ///< with every fibre at the network's tension: the network's part
  EdgeForces edge;                   ///< in addition to those of the adhesions
  double away_nN2 = 0;               ///< variance of the total by forces away from all adhesions that it holds
};

/// What the mean over meshes leaves of the beads.
struct Unexplained {
  double chi_squared_per_degree = 0;  ///< 1 where the model explains all but the noise
  double variance = 0;                ///< of a component of the data: see misfit_variance
  /// The same of what the adhesions' forces leave, each bead weighted by its leverage on the tensions, and its
  /// error by chance, relative: the tensions' errors follow it (White, Econometrica 48 (1980) 817).
  double leverage_weighted_variance = 0, leverage_weighted_error = 0;
  Loss loss = Loss::squares;  ///< that the first fit called for
};

struct EnsembleFit {
  FoundTensions tensions;
  FoundForces forces;
  std::optional<CutForce> cut;  ///< none: the image shows the whole cell
  /// Sums of the magnitudes of both, less what noise and the bounds t >= 0 add to them on average.
  Estimate total_force_nN, network_force_nN;
  Unexplained misfit;
  LinearData data;                        ///< as the loss weighs it
  std::optional<ModelError> model_error;  ///< determined by two meshes or more
  std::vector<MeshFit> meshes;
  Report report;  ///< converged where every fit is
};

/// Fit on the first network, then, from its answer, on the others in threads; how they differ (two of them or more) and
/// what they leave unexplained is the error of the model.
/// @param data  whatever its weights by bead are: another fit may have left them
/// @param adhesion_ids  the adhesion of each pair of columns of the data's compliance
/// @param start  tensions to start from, and an equilibrium of the first network near by; null: all equal
EnsembleFit fit_ensemble(const network::Ensemble& networks, LinearData data, const std::vector<int>& adhesion_ids,
                         const FitParameters& parameters, const Work& work, const SolvedMisfit& solved_misfit = {},
                         const Trial* start = nullptr);

/// The adhesions' forces as these data show them, which allow for more than those that the tensions were fitted to; the
/// tensions stay.
EnsembleFit with_forces_by(EnsembleFit fit, LinearData data);

/// Of Student's t at the estimate's degrees of freedom.
double quantile_975(const Estimate& estimate);
/// 95 % interval of a positive quantity, by Student's t. `high` is infinite where no bead feels it.
struct Interval {
  double low = 0, high = 0;
};
Interval interval_95(const Estimate& estimate);

/// A trial of the first network at these tensions, but for its equilibrium, which is near: where the next frame starts.
Trial next_start(const EnsembleFit& fit);

/// The tensions alone.
VectorXd values_of(const EnsembleFit& fit);

/// Unit vectors of forces (fx, fy by adhesion), zero where a force is: the change of the sum of their magnitudes is
/// along them.
VectorXd directions_of(const VectorXd& forces_nN, Index dimension = 2);

/// Covariance of estimates of what the beads do besides, from their noise and the model's error, the tensions following
/// both.
/// @param of_noise  of the numbers for noise of variance 1, the tensions held
/// @param by_force  the numbers by adhesion force: some × 2·adhesions
MatrixXd covariance_of_estimates(const EnsembleFit& fit, const MatrixXd& of_noise, const MatrixXd& by_force);

/// What the adhesions exert on the gel: the network's forces and their own.
VectorXd adhesion_forces_nN(const EnsembleFit& fit);
/// Of the sum of their magnitudes.
RoughnessOfTotal roughness_of_total(const EnsembleFit& fit);
/// How sums of these answer to the network's: weights by force × sums, of the network's.
MatrixXd by_network_force(const EnsembleFit& fit, const MatrixXd& sums);
/// Variances of such sums by the beads' noise, the tensions held.
VectorXd own_variances(const EnsembleFit& fit, const MatrixXd& sums);

/// By force (fx, fy by adhesion): how a force through the cut in this direction answers to those of the adhesions,
/// which it balances.
VectorXd along_cut(const Eigen::Vector2d& direction, Index n_forces);

/// Of the sum of these tensions.
Estimate sum_of(const EnsembleFit& fit, const std::vector<int>& indices);

}  // namespace mbtfm::tensions
