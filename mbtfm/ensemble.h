/// The fit on an ensemble of networks: the mesh is part of the model and its largest hidden error (docs/theory.md), so
/// every reported tension is the mean over independent meshes, and their spread is part of its error bar.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "mbtfm/tension_fit.h"

namespace mbtfm::inverse {

/// An estimate with the parts of its standard error.
struct Estimate {
  double value = 0;
  double noise = 0;   ///< from the beads
  double spread = 0;  ///< between meshes, of one further mesh (the cell's own) about the mean; 0 for one mesh
  double standard_error() const { return std::hypot(noise, spread); }
};

struct EnsembleFit {
  std::vector<int> fibre_ids;  ///< front() is 0, the actin network
  std::vector<Estimate> tensions_nN;
  Eigen::VectorXd forces_nN;                  ///< by adhesion: fx, fy; mean over the meshes
  Eigen::VectorXd torques_nN_um;              ///< by adhesion, about the origin; mean over the meshes
  std::vector<Estimate> force_magnitudes_nN;  ///< by adhesion
  Eigen::VectorXd network_forces_nN;          ///< with every fibre at the network's tension: the network's part
  double chi_squared_per_degree = 0;          ///< of the mean over meshes: 1 where the model explains all but the noise
  std::vector<TensionFit> fits;               ///< by mesh
  Report report;                              ///< converged where every fit is
};

/// Fit on each network; independent, so they run in threads.
/// @param adhesion_ids  the adhesion of each pair of columns of the data's compliance
EnsembleFit fit_ensemble(const std::vector<network::CableNetwork>& networks, const LinearData& data,
                         const std::vector<int>& adhesion_ids, const FitParameters& parameters, int threads,
                         const Progress& progress);

/// Half-width of the 95 % interval: Student's t with the degrees of freedom that the parts of the error have together
/// (Welch–Satterthwaite): many for the noise, meshes − 1 for the spread.
double half_width_95(const Estimate& estimate, int n_meshes);

}  // namespace mbtfm::inverse
