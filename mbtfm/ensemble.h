/// The fit on an ensemble of networks: the mesh is part of the model and its largest hidden error (docs/theory.md), so
/// every reported tension is the mean over independent meshes, and their spread is part of its error bar.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <vector>

#include "mbtfm/intervals.h"

namespace mbtfm::inverse {

/// An estimate with the parts of its standard error.
struct Estimate {
  double value = 0;
  double noise = 0;   ///< from the beads
  double spread = 0;  ///< between meshes, of one further mesh (the cell's own) about the mean; 0 for one mesh
  std::optional<Sides> noise_95 =
      {};  ///< where the beads' part of the 95 % interval is not 1.96 · noise to either side
  double standard_error() const { return std::hypot(noise, spread); }
};

/// What one mesh says.
struct MeshFit {
  TensionFit fit;
  Eigen::MatrixXd force_derivatives;  ///< dR/dt at the solution
  LocalMisfit local;
  Eigen::MatrixXd covariance_nN2;                    ///< of the tensions, from the beads' noise
  std::vector<Sides> intervals_95;                   ///< of the tensions, from the beads' noise
  Eigen::VectorXd network_forces_nN, torques_nN_um;  ///< by adhesion; see EnsembleFit
};

struct EnsembleFit {
  std::vector<int> fibre_ids;  ///< front() is 0, the actin network
  std::vector<Estimate> tensions_nN;
  Eigen::MatrixXd covariance_nN2;             ///< of the tensions, from the beads' noise; mean over the meshes
  Eigen::VectorXd forces_nN;                  ///< by adhesion: fx, fy; mean over the meshes
  Eigen::VectorXd torques_nN_um;              ///< by adhesion, about the origin; mean over the meshes
  std::vector<Estimate> force_magnitudes_nN;  ///< by adhesion
  Eigen::VectorXd network_forces_nN;          ///< with every fibre at the network's tension: the network's part
  double chi_squared_per_degree = 0;          ///< of the mean over meshes: 1 where the model explains all but the noise
  double variance = 0;                        ///< of a weighted component: see misfit_variance
  std::vector<MeshFit> meshes;
  Report report;  ///< converged where every fit is
};

/// Fit on each network: the first one alone, the others in threads from its answer.
/// @param data  its weights by bead are set where the loss is a robust one
/// @param adhesion_ids  the adhesion of each pair of columns of the data's compliance
/// @param start_nN  tensions to start from (those of the frame before), or none
EnsembleFit fit_ensemble(const std::vector<network::CableNetwork>& networks, LinearData& data,
                         const std::vector<int>& adhesion_ids, const FitParameters& parameters, int threads,
                         const Progress& progress, const SolvedMisfit& solved_misfit = {},
                         const std::optional<Eigen::VectorXd>& start_nN = {});

/// 95 % interval of a positive quantity: noise and spread combined to either side. Student's t with the degrees of
/// freedom that both have together (Welch–Satterthwaite): many for the noise, meshes − 1 for the spread.
struct Interval {
  double low = 0, high = 0;
};
Interval interval_95(const Estimate& estimate, int n_meshes);

/// Of the sum of these tensions.
Estimate sum_of(const EnsembleFit& fit, const std::vector<int>& indices);

}  // namespace mbtfm::inverse
