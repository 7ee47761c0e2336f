/// The nodes of a mesh that carry the unknowns: neither held nor hanging; and the matrix over them.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>

#include "pipeline/numerics/cholesky.h"
#include "substrate/elements/block_mesh.h"

namespace mbtfm::elements {

class FreeNodes {
 public:
  FreeNodes() = default;
  /// @param cell_nodes  nodes_per_cell each
  /// @param hanging     by node: what it hangs on; empty: a node of its own
  /// @param is_held     by node: its displacement is given
  FreeNodes(std::vector<int> cell_nodes, int nodes_per_cell, std::vector<std::vector<NodeWeight>> hanging,
            const std::vector<char>& is_held);

  int size() const { return n_free_; }
  int n_cells() const { return static_cast<int>(cell_nodes_.size()) / nodes_per_cell_; }
  /// Of a node; -1: held, or hanging.
  int index_of(int node) const { return free_of_node_[node]; }
  /// Nodes that are held, rising, and the place of each among them; -1: it is not held.
  const std::vector<int>& held() const { return held_; }
  int held_index_of(int node) const { return held_of_node_[node]; }
  /// The nodes that carry a node: itself, or what it hangs on.
  std::span<const NodeWeight> carriers(int node) const;
  const int* nodes_of(int cell) const { return &cell_nodes_[static_cast<std::size_t>(cell) * nodes_per_cell_]; }

  /// Zero, with a place for every two free nodes of one cell.
  numerics::BlockMatrix<3> pattern() const;
  /// Called with blocks of which the row is a free node's, the column any node's that is none that hangs.
  using AddHeld = std::function<void(int row, int node, const Eigen::Matrix3d& block)>;
  /// Add the stiffness of a cell, (3 nodes)²; `add_held` takes what belongs to nodes held; empty: nobody does.
  void add(int cell, const Eigen::MatrixXd& stiffness, numerics::BlockMatrix<3>& matrix,
           const AddHeld& add_held = {}) const;

  /// Values of nodes, as weights of free ones: what is held does not move.
  std::vector<NodeWeight> on_free_nodes(const std::vector<NodeWeight>& weights) const;

 private:
  std::vector<int> cell_nodes_;
  int nodes_per_cell_ = 1;
  std::vector<std::vector<NodeWeight>> hanging_;
  int n_free_ = 0;
  std::vector<int> free_of_node_, held_of_node_, held_;
  std::vector<NodeWeight> own_;  ///< by node: itself, with weight 1
};

/// Merge weights of equal nodes, by rising node.
void merge(std::vector<NodeWeight>& weights);

/// By load or point: its share of each free node.
using WeightedNodes = std::vector<std::vector<NodeWeight>>;

/// The rows of a column that hold the axes of each load or point.
struct Axes {
  Index first = 0, n = 3;  ///< the first axis, and how many
};

/// at(node, axis) += the loads' shares of a column's values.
template <class At>
void add_loads(const WeightedNodes& loads, Axes axes, const double* column, const At& at) {
  for (const auto& load : loads) {
    for (Index axis = axes.first; axis < axes.first + axes.n; ++axis, ++column) {
      if (*column == 0) continue;
      for (const auto& [node, weight] : load) at(node, static_cast<int>(axis)) += weight * *column;
    }
  }
}

/// column += at(node, axis), as each of the points has it.
template <class At>
void add_samples(const WeightedNodes& points, Axes axes, const At& at, double* column) {
  for (const auto& point : points) {
    for (Index axis = axes.first; axis < axes.first + axes.n; ++axis, ++column)
      for (const auto& [node, weight] : point) *column += weight * at(node, static_cast<int>(axis));
  }
}

/// Nodes that any of the points is a mean of.
std::vector<int> nodes_of(const WeightedNodes& points);

/// K⁻¹ between two lists of weighted nodes: symmetric, so that exchanging them transposes it exactly.
/// @param order  in which columns are solved for; empty: as they come
MatrixXd solve_between(const numerics::SparseCholesky& factor, const WeightedNodes& from, Axes from_axes,
                       const MatrixXd& values, const WeightedNodes& to, Axes to_axes,
                       const std::vector<int>& order = {});

}  // namespace mbtfm::elements
