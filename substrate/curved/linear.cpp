#include "substrate/curved/linear.h"

#include <Eigen/LU>
#include <cmath>

#include "substrate/material.h"

namespace mbtfm::curved {

Eigen::Vector3d Field::displacement_um(const Location& location) const {
  return space->values_of(location.cell, at_nodes_um) * shapes_at(location.unit);
}

Eigen::Matrix3d Field::gradient(const Location& location) const {
  const Slopes slopes = unit_slopes_at(location.unit);
  const Eigen::Matrix3d jacobian = space->mesh().positions_of(location.cell) * slopes;
  return space->values_of(location.cell, at_nodes_um) * slopes * jacobian.inverse();
}

std::function<MatrixXd(int cell)> linear_stiffness_of(const Gel& gel, const Mesh& mesh) {
  const double mu = substrate::shear_modulus_kPa(gel), lambda = substrate::lame_modulus_kPa(gel);
  return [=, &mesh](int cell) { return linear_stiffness(Element(mesh.positions_of(cell)), mu, lambda); };
}

Field solve_linear(const Gel& gel, std::shared_ptr<const Block> block, const Loading& loading,
                   const numerics::FactorOptions& options) {
  const auto space = std::make_shared<const Space>(block->mesh(), options.threads);
  const auto stiffness_of = linear_stiffness_of(gel, block->mesh());
  Vectors forces(space->nodes().size(), Eigen::Vector3d::Zero());
  if (loading.traction_kPa) forces = space->traction_forces_nN(loading.traction_kPa);
  if (loading.held_um) {
    const Vectors held = space->spread(Vectors(forces.size(), Eigen::Vector3d::Zero()), loading.held_um);
    const Vectors by_held = space->gather([&](int cell) -> NodeValues {
      const NodeValues u = space->values_of(cell, held);
      if (u.isZero()) return NodeValues::Zero();
      return NodeValues((stiffness_of(cell) * Eigen::Map<const VectorXd>(u.data(), kUnknowns)).eval().data());
    });
    for (std::size_t k = 0; k < forces.size(); ++k) forces[k] -= by_held[k];
  }
  Vectors at_nodes = space->spread(solve(*space->factorise(stiffness_of, options), forces), loading.held_um);
  return {std::move(block), space, std::move(at_nodes)};
}

std::vector<double> layers_um(double depth_um, int n) {
  constexpr double kGrowth = 1.4;
  std::vector<double> lines;
  for (int k = 0; k <= n; ++k) lines.push_back(depth_um * (std::pow(kGrowth, k) - 1) / (std::pow(kGrowth, n) - 1));
  lines.back() = depth_um;
  return lines;
}

}  // namespace mbtfm::curved
