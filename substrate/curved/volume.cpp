#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "substrate/curved/models.h"
#include "substrate/material.h"

namespace mbtfm::curved {
namespace {

/// The element's pressure over -lambda, as its coefficients: div u projected onto the pressures.
Eigen::Vector4d projected_divergence(const Element& element, const NodeValues& u) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (const QuadraturePoint& point : element.points) {
    sum += point.volume_um3 * (u * point.slopes).trace() * point.pressures;
  }
  return element.mass.ldlt().solve(sum);
}

}  // namespace

substrate::VolumeField volume_field(const Space& space, const Gel& gel, const Vectors& at_nodes_um, bool with_stress) {
  const Mesh& mesh = space.mesh();
  const double mu = substrate::shear_modulus_kPa(gel);
  const double lambda = substrate::lame_modulus_kPa(gel);
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
    const Element element(positions);
    const Eigen::Vector4d divergence = with_stress ? projected_divergence(element, u) : Eigen::Vector4d::Zero();
    for (int part = 0; part < 8; ++part) {
      const int i = part % 2, j = part / 2 % 2, k = part / 4;
      for (const int corner : kCorners) field.box_corners.push_back(mesh.nodes_of(cell)[i + 3 * j + 9 * k + corner]);
      if (!with_stress) continue;
      const Eigen::Vector3d unit(0.25 + 0.5 * i, 0.25 + 0.5 * j, 0.25 + 0.5 * k);
      const Slopes slopes = unit_slopes_at(unit);
      const Eigen::Matrix3d g = u * slopes * (positions * slopes).inverse();
      const double even = lambda * pressures_at(positions, positions * shapes_at(unit)).dot(divergence);
      field.stress_kPa.push_back({2 * mu * g(0, 0) + even, 2 * mu * g(1, 1) + even, 2 * mu * g(2, 2) + even,
                                  mu * (g(0, 1) + g(1, 0)), mu * (g(1, 2) + g(2, 1)), mu * (g(0, 2) + g(2, 0))});
    }
  }
  return field;
}

}  // namespace mbtfm::curved
