/// A shell between two spheres, its inner one held, of six patches of hexahedra: nothing of it is flat.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "substrate/elements/mesh.h"
#include "tests/support/test.h"

namespace mbtfm::test {

class CubedSphere {
 public:
  /// @param n, layers  cells along the side of a patch, and from the outer sphere to the inner
  CubedSphere(double inner_um, double outer_um, int n, int layers)
      : inner_(inner_um), outer_(outer_um), n_(n), layers_(layers) {
    std::map<std::array<long, 3>, int> node_at;
    for (int patch = 0; patch < 6; ++patch)
      for (int cell = 0; cell < n * n * layers; ++cell) {
        const Eigen::Vector3d low(cell % n, cell / n % n, static_cast<double>(cell / (n * n)));
        if (low.z() == 0) mesh.surface_cells.push_back(mesh.n_cells());
        for (int k = 0; k < elements::kNodes; ++k) {
          const Eigen::Vector3d at = place(patch, low + elements::unit_of_node(k));
          const Eigen::Vector3d digits = 1e7 / outer_um * at;
          const auto [found, is_new] =
              node_at.try_emplace({std::lround(digits.x()), std::lround(digits.y()), std::lround(digits.z())},
                                  static_cast<int>(mesh.position_um.size()));
          if (is_new) {
            mesh.position_um.push_back(at);
            mesh.is_held.push_back(at.norm() < inner_um * (1 + 1e-9));
          }
          mesh.cell_nodes.push_back(found->second);
        }
      }
    mesh.hanging.resize(mesh.position_um.size());
  }

  elements::Location locate(const Eigen::Vector3d& point) const {
    Eigen::Index axis = 0;
    point.cwiseAbs().maxCoeff(&axis);
    const int patch = 2 * static_cast<int>(axis) + (point[axis] < 0);
    const Eigen::Matrix3d axes = axes_of(patch);
    const Eigen::Vector3d local = axes.transpose() * point;
    const auto along = [&](double tangent) { return 0.5 * n_ * (1 + std::atan(tangent) * 4 / std::numbers::pi); };
    const Eigen::Vector3d at(along(local[0] / local[2]), along(local[1] / local[2]),
                             layers_ * (outer_ - point.norm()) / (outer_ - inner_));
    Eigen::Vector3d cell;
    for (int k = 0; k < 3; ++k) cell[k] = std::clamp(std::floor(at[k]), 0.0, (k < 2 ? n_ : layers_) - 1.0);
    elements::Location found{
        static_cast<int>(cell[0] + n_ * (cell[1] + n_ * (cell[2] + static_cast<double>(layers_) * patch))), at - cell};
    const elements::NodePositions nodes = mesh.positions_of(found.cell);
    for (int step = 0; step < 5; ++step) {
      const Eigen::Matrix3d jacobian = nodes * elements::unit_slopes_at(found.unit);
      found.unit += jacobian.inverse() * (point - nodes * elements::shapes_at(found.unit));
    }
    return found;
  }

  elements::Mesh mesh;

 private:
  /// Columns: along the patch, along it, outwards; x of them × y of them points inwards.
  static Eigen::Matrix3d axes_of(int patch) {
    Eigen::Matrix3d axes;
    const Eigen::Vector3d out = (patch % 2 ? -1.0 : 1.0) * Eigen::Vector3d::Unit(patch / 2);
    const Eigen::Vector3d first = Eigen::Vector3d::Unit((patch / 2 + 1) % 3);
    axes << first, -out.cross(first), out;
    return axes;
  }
  Eigen::Vector3d place(int patch, const Eigen::Vector3d& at) const {
    const auto tangent = [&](double x) { return std::tan(0.25 * std::numbers::pi * (2 * x / n_ - 1)); };
    const Eigen::Vector3d direction(tangent(at.x()), tangent(at.y()), 1);
    const double radius = outer_ - (outer_ - inner_) * at.z() / layers_;
    return radius * (axes_of(patch) * direction).normalized();
  }

  double inner_, outer_;
  int n_, layers_;
};

}  // namespace mbtfm::test
