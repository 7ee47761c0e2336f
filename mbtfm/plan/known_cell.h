/// What a plan knows of its cell whatever gel and beads are: forces, how they follow the tensions, and by how much a
/// fit errs whose beads are exact.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "network/cables/cables.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/work.h"
#include "substrate/ellipse.h"
#include "substrate/response.h"

namespace mbtfm::plan {

struct Scene;

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

}  // namespace mbtfm::plan
