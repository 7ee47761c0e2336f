#include "substrate/elements/space.h"

#include <algorithm>
#include <numeric>

#include "pipeline/numerics/parallel.h"
#include "pipeline/numerics/quadrature.h"

namespace mbtfm::elements {
namespace {

// so many matrices of cells are held at a time: 6 MB
constexpr int kBatch = 128;

/// Call `make(cell)` of some cells at a time side by side, then `take(cell, made)` one after the other.
template <class Made, class Make, class Take>
void in_batches(int n_cells, int threads, const Make& make, const Take& take) {
  std::vector<Made> made(kBatch);
  for (int first = 0; first < n_cells; first += kBatch) {
    const int n = std::min(kBatch, n_cells - first);
    numerics::parallel_for(n, threads, [&](int k) { made[k] = make(first + k); });
    for (int k = 0; k < n; ++k) take(first + k, made[k]);
  }
}

}  // namespace

Space::Space(const Mesh& mesh, int threads)
    : mesh_(mesh), threads_(threads), nodes_(mesh.cell_nodes, kNodes, mesh.hanging, mesh.is_held) {}

std::shared_ptr<const numerics::SparseCholesky> Space::factorise(const std::function<MatrixXd(int cell)>& stiffness_of,
                                                                 const numerics::FactorOptions& options,
                                                                 const FreeNodes::AddHeld& add_held) const {
  numerics::BlockMatrix<3> matrix = nodes_.pattern();
  in_batches<MatrixXd>(mesh_.n_cells(), threads_, stiffness_of,
                       [&](int cell, const MatrixXd& of_cell) { nodes_.add(cell, of_cell, matrix, add_held); });
  std::call_once(order_->is_found, [&] {
    order_->elimination = std::make_shared<const numerics::Elimination>(matrix, numerics::Search::quick);
  });
  return std::make_shared<const numerics::SparseCholesky>(matrix, options, order_->elimination);
}

Vectors Space::gather(const std::function<NodeValues(int cell)>& forces_of) const {
  Vectors forces(nodes_.size(), Eigen::Vector3d::Zero());
  in_batches<NodeValues>(mesh_.n_cells(), threads_, forces_of, [&](int cell, const NodeValues& of_cell) {
    for (int k = 0; k < kNodes; ++k) {
      for (const auto& [node, weight] : nodes_.carriers(mesh_.nodes_of(cell)[k])) {
        const int index = nodes_.index_of(node);
        if (index >= 0) forces[index] += weight * of_cell.col(k);
      }
    }
  });
  return forces;
}

Vectors Space::traction_forces_nN(const OfSurface& traction_kPa) const {
  constexpr int kPoints = 6;  // a traction may have finer detail than the displacement
  Vectors forces(nodes_.size(), Eigen::Vector3d::Zero());
  for (const int cell : mesh_.surface_cells) {
    for (const auto& [at, shapes, weight] : face_rule(mesh_.positions_of(cell), kPoints)) {
      const double area = at.area_um2.norm();
      const Eigen::Vector3d force = weight * area * traction_kPa(at.position_um, at.area_um2 / area);
      for (int k = 0; k < kNodes; ++k) {
        if (shapes[k] == 0) continue;
        for (const auto& [node, share] : nodes_.carriers(mesh_.nodes_of(cell)[k])) {
          const int index = nodes_.index_of(node);
          if (index >= 0) forces[index] += share * shapes[k] * force;
        }
      }
    }
  }
  return forces;
}

Vectors Space::spread(const Vectors& free_um, const OfPlace& held_um) const {
  Vectors values(mesh_.position_um.size(), Eigen::Vector3d::Zero());
  const auto own = [&](int node) -> Eigen::Vector3d {
    const int index = nodes_.index_of(node);
    if (index >= 0) return free_um[index];
    return held_um ? held_um(mesh_.position_um[node]) : Eigen::Vector3d(Eigen::Vector3d::Zero());
  };
  for (std::size_t node = 0; node < values.size(); ++node) {
    for (const auto& [carrier, weight] : nodes_.carriers(static_cast<int>(node))) values[node] += weight * own(carrier);
  }
  return values;
}

Vectors Space::of_free_nodes(const Vectors& at_nodes) const {
  Vectors free(nodes_.size());
  for (std::size_t node = 0; node < at_nodes.size(); ++node) {
    const int index = nodes_.index_of(static_cast<int>(node));
    if (index >= 0) free[index] = at_nodes[node];
  }
  return free;
}

NodeValues Space::values_of(int cell, const Vectors& at_nodes) const {
  NodeValues values;
  for (int k = 0; k < kNodes; ++k) values.col(k) = at_nodes[mesh_.nodes_of(cell)[k]];
  return values;
}

std::vector<NodeWeight> Space::weights_at(const Location& location) const {
  const Shapes shapes = shapes_at(location.unit);
  std::vector<NodeWeight> weights;
  for (int k = 0; k < kNodes; ++k) {
    if (shapes[k] != 0) weights.push_back({mesh_.nodes_of(location.cell)[k], shapes[k]});
  }
  return nodes_.on_free_nodes(weights);
}

std::vector<FaceRulePoint> face_rule(const NodePositions& nodes_um, int n) {
  const numerics::GaussRule gauss = numerics::gauss_legendre(n);
  std::vector<FaceRulePoint> rule;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double x = 0.5 * (1 + gauss.nodes[i]), y = 0.5 * (1 + gauss.nodes[j]);
      rule.push_back({face_point(nodes_um, x, y), shapes_at({x, y, 0}), 0.25 * gauss.weights[i] * gauss.weights[j]});
    }
  }
  return rule;
}

Vectors solve(const numerics::SparseCholesky& factor, const Vectors& forces_nN) {
  std::vector<int> all(forces_nN.size());
  std::iota(all.begin(), all.end(), 0);
  Vectors solution(forces_nN.size());
  factor.solve(
      1, all,
      [&](int, const numerics::NodalColumn& b) {
        for (const int node : all) {
          for (int axis = 0; axis < 3; ++axis) b(node, axis) = forces_nN[node][axis];
        }
      },
      [&](int, const numerics::NodalColumn& u) {
        for (const int node : all) {
          for (int axis = 0; axis < 3; ++axis) solution[node][axis] = u(node, axis);
        }
      });
  return solution;
}

}  // namespace mbtfm::elements
