#include "substrate/elements/volume.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "pipeline/numerics/quadrature.h"

namespace mbtfm::elements {
namespace {

/// div u projected onto the pressures, as their coefficients.
Eigen::Vector4d projected_divergence(const Element& element, const NodeValues& u) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (const QuadraturePoint& point : element.points) {
    sum += point.volume_um3 * (u * point.slopes).trace() * point.pressures;
  }
  return element.mass.ldlt().solve(sum);
}

/// Of an eighth of a cell. Two points along each side make the mean of what is quadratic, exactly in boxes.
Eigen::Matrix3d gradient_in(const Eigen::Vector3d& low, const NodePositions& x, const NodeValues& u, int n_points) {
  const numerics::GaussRule gauss = numerics::gauss_legendre(n_points);
  const auto at = [&](int k) { return 0.25 * (1 + gauss.nodes[k % n_points]); };
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const int n = n_points * n_points * n_points;
  for (int k = 0; k < n; ++k) {
    const Slopes slopes = unit_slopes_at(low + Eigen::Vector3d(at(k), at(k / n_points), at(k / (n_points * n_points))));
    sum += u * slopes * (x * slopes).inverse();
  }
  return sum / n;
}

}  // namespace

StressLaw linear_stress(const Space& space, const substrate::Material& material, const Vectors& at_nodes_um) {
  const double mu = substrate::shear_modulus_kPa(material.gel), lambda = substrate::lame_modulus_kPa(material.gel);
  StressLaw law{.at = [=](const Eigen::Matrix3d& g, double dilatation, double z_um) -> Eigen::Matrix3d {
    return substrate::relative_modulus(material, z_um, z_um) *
           (mu * (g + g.transpose()) + lambda * dilatation * Eigen::Matrix3d::Identity());
  }};
  for (int cell = 0; cell < space.mesh().n_cells(); ++cell) {
    law.pressures.emplace_back(
        projected_divergence(Element(space.mesh().positions_of(cell)), space.values_of(cell, at_nodes_um)));
  }
  return law;
}

substrate::VolumeField volume_field(const Space& space, const Vectors& at_nodes_um, const StressLaw& stress,
                                    Gradients gradients) {
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
      const Eigen::Vector3d low(0.5 * i, 0.5 * j, 0.5 * k);
      const Eigen::Vector3d middle = positions * shapes_at(low + Eigen::Vector3d::Constant(0.25));
      const Eigen::Matrix3d sigma = stress.at(gradient_in(low, positions, u, gradients == Gradients::mean ? 2 : 1),
                                              pressures_at(positions, middle).dot(stress.pressures[cell]), middle.z());
      field.stress_kPa.push_back({sigma(0, 0), sigma(1, 1), sigma(2, 2), sigma(0, 1), sigma(1, 2), sigma(0, 2)});
    }
  }
  return field;
}

}  // namespace mbtfm::elements
