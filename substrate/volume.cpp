#include "substrate/volume.h"

#include "substrate/half_space.h"

namespace mbtfm::substrate {
namespace {

using Gradient = std::array<std::array<double, 3>, 3>;  ///< [i][j] = d u_i / d x_j

/// Of the shape functions' sum at the centre of a box, where its mean is for trilinear elements.
Gradient gradient_at_centre(const BlockMesh& mesh, int cell, const std::vector<std::array<double, 3>>& u) {
  const int n = mesh.order + 1;
  const auto value = shape_values(mesh.order, 0.5), slope = shape_slopes(mesh.order, 0.5);
  Gradient gradient{};
  for (int k = 0; k < mesh.nodes_per_cell(); ++k) {
    const int index[3] = {k % n, k / n % n, k / (n * n)};
    for (int j = 0; j < 3; ++j) {
      double d = 1 / mesh.cells[cell].size_um[j];
      for (int axis = 0; axis < 3; ++axis) d *= axis == j ? slope[index[axis]] : value[index[axis]];
      for (int i = 0; i < 3; ++i) gradient[i][j] += d * u[mesh.nodes_of(cell)[k]][i];
    }
  }
  return gradient;
}

/// Mean of div u over a box, from the displacement through its faces: what the element's pressure takes at its centre.
double mean_divergence(const BlockMesh& mesh, int cell, const std::vector<std::array<double, 3>>& u) {
  // Simpson's rule and the trapezoidal one: exact for quadratic and linear faces
  const std::array<double, 3> weight =
      mesh.order == 1 ? std::array{0.5, 0.5, 0.0} : std::array{1.0 / 6, 4.0 / 6, 1.0 / 6};
  const int n = mesh.order + 1;
  double sum = 0;
  for (int k = 0; k < mesh.nodes_per_cell(); ++k) {
    const int index[3] = {k % n, k / n % n, k / (n * n)};
    for (int axis = 0; axis < 3; ++axis) {
      if (index[axis] != 0 && index[axis] != mesh.order) continue;
      const double across = weight[index[(axis + 1) % 3]] * weight[index[(axis + 2) % 3]];
      sum += (index[axis] == 0 ? -1 : 1) * across * u[mesh.nodes_of(cell)[k]][axis] / mesh.cells[cell].size_um[axis];
    }
  }
  return sum;
}

std::array<double, 6> stress_kPa(const BlockMesh& mesh, int cell, const Material& material,
                                 const std::vector<std::array<double, 3>>& u) {
  const Box& box = mesh.cells[cell];
  const double middle = box.low_um[2] + 0.5 * box.size_um[2];
  const double mu = shear_modulus_kPa(material.gel) * relative_modulus(material, middle, middle + box.size_um[2]);
  const double nu = material.gel.poisson_ratio;
  const Gradient g = gradient_at_centre(mesh, cell, u);
  const double even = 2 * mu * nu / (1 - 2 * nu) * mean_divergence(mesh, cell, u);
  return {2 * mu * g[0][0] + even,  2 * mu * g[1][1] + even,  2 * mu * g[2][2] + even,
          mu * (g[0][1] + g[1][0]), mu * (g[1][2] + g[2][1]), mu * (g[0][2] + g[2][0])};
}

}  // namespace

VolumeField volume_field(const ElasticSystem& system, const Material& material, const NodalColumn& u,
                         bool with_stress) {
  const BlockMesh& mesh = system.mesh();
  const auto values = system.at_all_nodes(u);
  VolumeField field;
  std::vector<int> point_of_node(values.size(), -1);  // corners alone
  const int n = mesh.order + 1, e = mesh.order;
  const int corners[8] = {0, e, e * n + e, e * n, e * n * n, e * n * n + e, e * n * n + e * n + e, e * n * n + e * n};
  for (std::size_t cell = 0; cell < mesh.cells.size(); ++cell) {
    for (const int corner : corners) {
      const int node = mesh.nodes_of(static_cast<int>(cell))[corner];
      if (point_of_node[node] < 0) {
        point_of_node[node] = static_cast<int>(field.points_um.size());
        field.points_um.push_back(mesh.position_um[node]);
        field.displacement_um.push_back(values[node]);
      }
      field.box_corners.push_back(point_of_node[node]);
    }
    if (with_stress) field.stress_kPa.push_back(stress_kPa(mesh, static_cast<int>(cell), material, values));
  }
  return field;
}

}  // namespace mbtfm::substrate
