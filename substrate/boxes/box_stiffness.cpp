
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/quadrature.h"
#include "substrate/boxes/elastic_system.h"
#include "substrate/material.h"

namespace mbtfm::boxes {

namespace {

/// Value and slopes (1/um) of each shape function of a box at a point of [0, 1]³.
struct Shapes {
  std::vector<std::array<double, 3>> slope;
};

Shapes shapes_at(int order, std::array<double, 3> size, std::array<double, 3> t) {
  std::array<std::array<double, 3>, 3> value, slope;
  for (int axis = 0; axis < 3; ++axis) {
    value[axis] = shape_values(order, t[axis]);
    slope[axis] = shape_slopes(order, t[axis]);
  }
  Shapes shapes;
  for (int k = 0; k <= order; ++k) {
    for (int j = 0; j <= order; ++j) {
      for (int i = 0; i <= order; ++i) {
        shapes.slope.push_back({slope[0][i] * value[1][j] * value[2][k] / size[0],
                                value[0][i] * slope[1][j] * value[2][k] / size[1],
                                value[0][i] * value[1][j] * slope[2][k] / size[2]});
      }
    }
  }
  return shapes;
}

}  // namespace

MatrixXd box_stiffness(const substrate::Material& material, int order, const Box& box) {
  const Gel& gel = material.gel;
  const std::array<double, 3>& size_um = box.size_um;
  const double mu = substrate::shear_modulus_kPa(gel);
  const double lambda = substrate::lame_modulus_kPa(gel);
  const int n_nodes = (order + 1) * (order + 1) * (order + 1);
  const int n_pressures = order == 1 ? 1 : 4;  // 1, and x, y, z from the centre
  const double volume = size_um[0] * size_um[1] * size_um[2];
  MatrixXd stiffness = MatrixXd::Zero(3 * n_nodes, 3 * n_nodes);
  MatrixXd divergence = MatrixXd::Zero(3 * n_nodes, n_pressures);       // (q_m, div v)
  MatrixXd compressibility = MatrixXd::Zero(n_pressures, n_pressures);  // (q_m, q_n / lambda)
  const double middle_um = box.low_um[2] + 0.5 * size_um[2];
  const numerics::GaussRule gauss = numerics::gauss_legendre(order + 1);
  const int n = order + 1;
  for (int point = 0; point < n * n * n; ++point) {
    const int index[3] = {point % n, point / n % n, point / (n * n)};
    std::array<double, 3> t;
    double weight = volume;
    for (int axis = 0; axis < 3; ++axis) {
      t[axis] = 0.5 * (1 + gauss.nodes[index[axis]]);
      weight *= 0.5 * gauss.weights[index[axis]];
    }
    const auto slope = shapes_at(order, size_um, t).slope;
    const double pressure[4] = {1, 2 * t[0] - 1, 2 * t[1] - 1, 2 * t[2] - 1};
    const double modulus = substrate::relative_modulus(material, box.low_um[2] + t[2] * size_um[2], middle_um);
    for (int m = 0; m < n_pressures; ++m) {
      for (int l = 0; l < n_pressures; ++l) compressibility(m, l) += weight / modulus * pressure[m] * pressure[l];
    }
    for (int a = 0; a < n_nodes; ++a) {
      for (int i = 0; i < 3; ++i) {
        for (int m = 0; m < n_pressures; ++m) divergence(3 * a + i, m) += weight * pressure[m] * slope[a][i];
      }
      for (int b = 0; b < n_nodes; ++b) {
        // 2 mu eps : eps = mu (grad_a . grad_b d_ij + d_j N_a d_i N_b)
        double product = 0;
        for (int k = 0; k < 3; ++k) product += slope[a][k] * slope[b][k];
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) {
            stiffness(3 * a + i, 3 * b + j) +=
                mu * modulus * weight * ((i == j ? product : 0) + slope[a][j] * slope[b][i]);
          }
        }
      }
    }
  }
  stiffness += lambda * divergence * numerics::solve_symmetric(compressibility, divergence.transpose());
  return stiffness;
}

}  // namespace mbtfm::boxes
