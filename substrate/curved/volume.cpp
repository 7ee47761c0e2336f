#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "substrate/curved/models.h"
#include "substrate/material.h"

namespace mbtfm::curved {
namespace {

/// div u projected onto the pressures, as their coefficients.
Eigen::Vector4d projected_divergence(const Element& element, const NodeValues& u) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (const QuadraturePoint& point : element.points) {
    sum += point.volume_um3 * (u * point.slopes).trace() * point.pressures;
  }
  return element.mass.ldlt().solve(sum);
}

}  // namespace

StressLaw linear_stress(const Space& space, const Gel& gel, const Vectors& at_nodes_um) {
  const double mu = substrate::shear_modulus_kPa(gel), lambda = substrate::lame_modulus_kPa(gel);
  StressLaw law{.at = [mu](const Eigen::Matrix3d& g, double pressure) -> Eigen::Matrix3d {
    return mu * (g + g.transpose()) + pressure * Eigen::Matrix3d::Identity();
  }};
  for (int cell = 0; cell < space.mesh().n_cells(); ++cell) {
    law.pressure_kPa.emplace_back(
        lambda * projected_divergence(Element(space.mesh().positions_of(cell)), space.values_of(cell, at_nodes_um)));
  }
  return law;
}

substrate::VolumeField volume_field(const Space& space, const Vectors& at_nodes_um, const StressLaw& stress) {
  const Mesh& mesh = space.mesh();
  substrate::VolumeField field;
  const auto numbers = [](const Eigen::Vector3d& v) { return std::array{v.x(), v.y(), v.z()}; };
  for (std::size_t node = 0; node < mesh.position_um.size(); ++node) {
    field.points_um.push_back(numbers(mesh.position_um[node]));
    field.displacement_um.push_back(numbers(at_nodes_um[node]));
  }
  constexpr std::array kCorners = {0, 1, 4, 3, 9, 10, 13, 12};
  for (int cell = 0; cell < mesh.n_cells(); ++cell) {
    const NodePositions positions = mesh.positions_of(cell);
    const NodeValues u = space.values_of(cell, at_nodes_um);
    for (int part = 0; part < 8; ++part) {
      const int i = part % 2, j = part / 2 % 2, k = part / 4;
      for (const int corner : kCorners) field.box_corners.push_back(mesh.nodes_of(cell)[i + 3 * j + 9 * k + corner]);
      if (!stress.at) continue;
      const Eigen::Vector3d unit(0.25 + 0.5 * i, 0.25 + 0.5 * j, 0.25 + 0.5 * k);
      const Slopes slopes = unit_slopes_at(unit);
      const Eigen::Matrix3d g = u * slopes * (positions * slopes).inverse();
      const double pressure = pressures_at(positions, positions * shapes_at(unit)).dot(stress.pressure_kPa[cell]);
      const Eigen::Matrix3d sigma = stress.at(g, pressure);
      field.stress_kPa.push_back({sigma(0, 0), sigma(1, 1), sigma(2, 2), sigma(0, 1), sigma(1, 2), sigma(0, 2)});
    }
  }
  return field;
}

}  // namespace mbtfm::curved
