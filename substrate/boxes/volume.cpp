#include "substrate/boxes/elastic_system.h"

#include "substrate/material.h"

namespace mbtfm::boxes {
namespace {

using Gradient = std::array<std::array<double, 3>, 3>;  ///< [i][j] = d u_i / d x_j
using Part = std::array<int, 3>;                        ///< of a box cut at its nodes: half of each side, or all of it

Part index_of(int k, int n) { return {k % n, k / n % n, k / (n * n)}; }

/// At each node of a box.
std::vector<Gradient> gradients(const BlockMesh& mesh, int cell, const std::vector<std::array<double, 3>>& u) {
  const int n = mesh.order + 1;
  const int stride[3] = {1, n, n * n};
  std::vector<Gradient> at_node(mesh.nodes_per_cell());
  for (int k = 0; k < mesh.nodes_per_cell(); ++k) {
    const Part index = index_of(k, n);
    for (int j = 0; j < 3; ++j) {
      const auto slope = shape_slopes(mesh.order, static_cast<double>(index[j]) / mesh.order);
      for (int m = 0; m < n; ++m) {
        const int node = mesh.nodes_of(cell)[k + (m - index[j]) * stride[j]];
        for (int i = 0; i < 3; ++i) at_node[k][i][j] += slope[m] / mesh.cells[cell].size_um[j] * u[node][i];
      }
    }
  }
  return at_node;
}

/// Mean of a linear or quadratic function over a part of [0, 1], from its values at the nodes.
std::array<double, 3> mean_weights(int order, int part) {
  if (order == 1) return {0.5, 0.5, 0};
  return part == 0 ? std::array{5.0 / 12, 8.0 / 12, -1.0 / 12} : std::array{-1.0 / 12, 8.0 / 12, 5.0 / 12};
}

/// Means over a part of a box: they add up to those that the elements' balance of forces is made of.
Gradient mean_gradient(int order, const std::vector<Gradient>& at_node, const Part& part) {
  Gradient mean{};
  for (int k = 0; k < static_cast<int>(at_node.size()); ++k) {
    double weight = 1;
    for (int j = 0; j < 3; ++j) weight *= mean_weights(order, part[j])[index_of(k, order + 1)[j]];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) mean[i][j] += weight * at_node[k][i][j];
    }
  }
  return mean;
}

/// The element's pressure, over -lambda, in the middle of a part: div u projected onto 1, x, y, z (or 1, for order 1).
/// With t = x - 1/2 its slope is 12 (div u, t), by Simpson's rule, exact here; nodes lie at t = 0 and 1/2 to either
/// side, the part's middle at 1/4: 12 / (2 · 4) = 3/2.
double projected_divergence(int order, const std::vector<Gradient>& at_node, const Part& part) {
  double sum = 0;
  for (int k = 0; k < static_cast<int>(at_node.size()); ++k) {
    const Part index = index_of(k, order + 1);
    double whole = 1, linear = 1;
    for (int j = 0; j < 3; ++j) {
      whole *= 0.5 * (mean_weights(order, 0)[index[j]] + mean_weights(order, 1)[index[j]]);
      if (order == 2) linear += 1.5 * (2 * part[j] - 1) * (index[j] - 1);
    }
    sum += whole * linear * (at_node[k][0][0] + at_node[k][1][1] + at_node[k][2][2]);
  }
  return sum;
}

/// Mean over a part of a box.
std::array<double, 6> stress_kPa(const BlockMesh& mesh, int cell, const Part& part, const substrate::Material& material,
                                 const std::vector<Gradient>& at_node) {
  const double height = mesh.cells[cell].size_um[2] / mesh.order;
  const double middle = mesh.cells[cell].low_um[2] + (part[2] + 0.5) * height;
  const double mu =
      substrate::shear_modulus_kPa(material.gel) * substrate::relative_modulus(material, middle, middle + height);
  const double nu = material.gel.poisson_ratio;
  const Gradient g = mean_gradient(mesh.order, at_node, part);
  const double even = 2 * mu * nu / (1 - 2 * nu) * projected_divergence(mesh.order, at_node, part);
  return {2 * mu * g[0][0] + even,  2 * mu * g[1][1] + even,  2 * mu * g[2][2] + even,
          mu * (g[0][1] + g[1][0]), mu * (g[1][2] + g[2][1]), mu * (g[0][2] + g[2][0])};
}

}  // namespace

substrate::VolumeField volume_field(const ElasticSystem& system, const substrate::Material& material,
                                    const numerics::NodalColumn& u, bool with_stress) {
  const BlockMesh& mesh = system.mesh();
  const auto values = system.at_all_nodes(u);
  substrate::VolumeField field;
  std::vector<int> point_of_node(values.size(), -1);
  const int n = mesh.order + 1;
  const int corners[8] = {0, 1, n + 1, n, n * n, n * n + 1, n * n + n + 1, n * n + n};
  for (int cell = 0; cell < static_cast<int>(mesh.cells.size()); ++cell) {
    const std::vector<Gradient> at_node = with_stress ? gradients(mesh, cell, values) : std::vector<Gradient>();
    for (int k = 0; k < mesh.order * mesh.order * mesh.order; ++k) {
      const Part part = index_of(k, mesh.order);
      for (const int corner : corners) {
        const int node = mesh.nodes_of(cell)[part[0] + n * (part[1] + n * part[2]) + corner];
        if (point_of_node[node] < 0) {
          point_of_node[node] = static_cast<int>(field.points_um.size());
          field.points_um.push_back(mesh.position_um[node]);
          field.displacement_um.push_back(values[node]);
        }
        field.box_corners.push_back(point_of_node[node]);
      }
      if (with_stress) field.stress_kPa.push_back(stress_kPa(mesh, cell, part, material, at_node));
    }
  }
  return field;
}

}  // namespace mbtfm::boxes
