/// What a plan knows of its cell whatever gel and beads are: forces, how they follow the tensions, and by how much a
/// fit errs whose beads are exact. And how exactly beads can determine tensions and forces: the Cramér–Rao bound.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "network/cables/cables.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/results.h"
#include "pipeline/contract/work.h"
#include "samples/drawing/random.h"
#include "samples/plan/scene.h"
#include "substrate/ellipse.h"
#include "substrate/response.h"

namespace mbtfm::plan {

/// By label: the network, then the fibres.
struct KnownCell {
  std::vector<int> adhesion_ids;
  std::vector<substrate::Ellipse> ellipses;
  std::vector<cables::CableNetwork> networks;  ///< those of a fit
  std::vector<int> fibre_ids;                  ///< front() is 0
  Eigen::VectorXd tensions_nN;
  Eigen::VectorXd forces_nN;                 ///< of the cell's own, finer network: 2·adhesions
  std::vector<Eigen::MatrixXd> derivatives;  ///< of the forces by tension, by network of a fit
};
/// @throws NotSolved where the cables find no equilibrium
KnownCell known_cell(const Scene& scene, const Work& work);

/// 2·adhesions
Eigen::VectorXd column_of(const std::vector<AdhesionForce>& forces);
/// Beads at these places as the exact answer of a gel to the cell's forces, each with this standard error.
DisplacementField exact_beads(const std::vector<Vec2>& places_um, const substrate::Response& response,
                              const Eigen::VectorXd& forces_nN, double sigma_um);

/// Standard errors that do not come from the beads. They hold for any gel, noise and density: the misfit that the model
/// makes and the tensions' answer to it scale alike.
struct OtherParts {
  double mesh_nN = 0, segmentation_nN = 0, other_nN = 0;  ///< other: the model's misfit, the gel's own error
  double total_nN() const {
    return std::sqrt(mesh_nN * mesh_nN + segmentation_nN * segmentation_nN + other_nN * other_nN);
  }
};
struct ModelErrors {
  std::vector<OtherParts> tensions;  ///< by label
  OtherParts total_force, network_force;
  Eigen::VectorXd adhesion_forces_nN;  ///< by adhesion
  double total_force_nN = 0, network_force_nN = 0;
};
/// From a fit of exact beads and its error budget.
ModelErrors model_errors(const Scene& scene, const KnownCell& cell, const DisplacementField& beads,
                         substrate::SharedResponse response, const Work& work);

/// Standard errors by the beads' noise alone, for a noise of 1 um on a gel of 1 kPa:
///
///   Cov = (Dᵀ Gᵀ P G D)⁻¹,   D = dR/dt, G the gel's compliance, P what the beads do besides taken off
///
/// of the tensions. G falls with the modulus and nothing else depends on it, so all of them grow with noise times
/// modulus. The beads' squares add up, so the covariance falls with their number, but for which places they happen to
/// have. Source: Rao, Linear Statistical Inference (1973), 5a. Of the best unbiased estimate: bounds t >= 0 can only
/// lower the scatter.
struct Precision {
  Eigen::VectorXd tensions;         ///< nN/(um kPa), by label
  double total_force = 0;           ///< of the sum of the adhesions' forces, from the tensions
  Eigen::VectorXd adhesion_forces;  ///< by adhesion, along its force, from the tensions
  Eigen::VectorXd free_forces;      ///< the same of forces independent of each other, as `adhesion-forces` finds them
};

/// At places that beads may have.
struct BeadsOnGel {
  std::vector<Vec2> places_um;
  substrate::SharedResponse response;  ///< of a gel of `modulus_kPa`
  double modulus_kPa = 0;
};
/// @throws UsageError where so many beads do not fit
BeadsOnGel beads_on_gel(const Scene& scene, const KnownCell& cell, double beads_per_um2, std::uint64_t draw,
                        int threads);
/// A random part of them. @param share  0 … 1
BeadsOnGel some_of(const BeadsOnGel& beads, double share, drawing::Random& random);

Precision precision_of(const Scene& scene, const KnownCell& cell, const BeadsOnGel& beads, int threads);

/// At these densities: parts of the beads of several draws, root mean square over the draws, as one draw of beads is
/// not another.
/// @param beads_per_um2  ascending
struct Densities {
  std::vector<double> beads_per_um2;
  std::vector<Precision> precision;  ///< by density
};
Densities precision_at(const Scene& scene, const KnownCell& cell, const std::vector<double>& beads_per_um2,
                       const Work& work);

}  // namespace mbtfm::plan
