/// What beads will determine of tractions in space, before their noise is known.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "mbtfm/spatial/reconstruction.h"

namespace mbtfm::spatial {

/// What a reconstruction of beads with this noise states in the mean.
struct Foreseen {
  double lambda = 0;   ///< of the problem's own errors
  double degrees = 0;  ///< how many numbers the beads determine
  /// Of the forces on adhesions, x, y, z of each in turn: as forces_beside_background() states it, and its part by the
  /// noise of the beads. The rest is the background that they do not separate from the forces.
  MatrixXd covariance_nN2, by_noise_nN2;
  VectorXd mean_nN;                                 ///< those forces, in the mean
  Eigen::Matrix3d net_force_nN2, net_by_noise_nN2;  ///< the same of the sum over the surface
  std::vector<double> resolution_um;                ///< by vertex
};

/// Tikhonov, by whose lambda and variance all standard errors of forces are stated, for every noise from one
/// decomposition. With noise s times the problem's errors, S u − S G t is s times as far off, and nothing else changes:
/// lambda and the variance v = s² of a datum follow from the criteria's expectation over noise. A modulus m times as
/// large makes all displacements m times smaller, which is the noise s m.
class Foresight {
 public:
  /// @param problem  with the displacement of known tractions as exact data, and forces on adhesions asked for
  /// @throws UsageError where the problem has no matrices, or no displacement
  Foresight(const Problem& problem, const tractions::TractionParameters& traction, int threads);
  /// @param noise  over the errors that the problem's beads state; more than 0
  Foreseen at(double noise) const;

 private:
  const Problem& problem_;
  tractions::TractionParameters traction_;
  std::optional<inverse::Spectrum> spectrum_;  ///< of A, the weighed answers to the unknowns
  MatrixXd patches_;                           ///< PᵀP, P the weighed answers to forces
  MatrixXd hidden_;                            ///< Vᵀ Aᵀ P
  VectorXd pulled_by_patches_;                 ///< Pᵀ u
  VectorXd pulled_;                            ///< Vᵀ Aᵀ u
  MatrixXd sums_;                              ///< Vᵀ of the sum over the surface, x, y, z
  MatrixXd shown_;  ///< by vertex and direction: what of a change of its traction lies along it
};

}  // namespace mbtfm::spatial
