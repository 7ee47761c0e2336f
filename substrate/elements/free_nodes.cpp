#include "substrate/elements/free_nodes.h"

#include <algorithm>

namespace mbtfm::elements {

FreeNodes::FreeNodes(std::vector<int> cell_nodes, int nodes_per_cell, std::vector<std::vector<NodeWeight>> hanging,
                     const std::vector<char>& is_held)
    : cell_nodes_(std::move(cell_nodes)), nodes_per_cell_(nodes_per_cell), hanging_(std::move(hanging)) {
  const std::size_t n_nodes = is_held.size();
  free_of_node_.assign(n_nodes, -1);
  held_of_node_.assign(n_nodes, -1);
  for (std::size_t node = 0; node < n_nodes; ++node) {
    own_.push_back({static_cast<int>(node), 1});
    if (!hanging_[node].empty()) continue;
    if (is_held[node]) {
      held_of_node_[node] = static_cast<int>(held_.size());
      held_.push_back(static_cast<int>(node));
    } else {
      free_of_node_[node] = n_free_++;
    }
  }
}

std::span<const NodeWeight> FreeNodes::carriers(int node) const {
  const std::vector<NodeWeight>& hanging = hanging_[node];
  return hanging.empty() ? std::span(&own_[node], 1) : std::span(hanging);
}

numerics::BlockMatrix<3> FreeNodes::pattern() const {
  std::vector<std::vector<int>> nodes_of_cell(n_cells());
  std::vector<std::vector<int>> cells_of_node(n_free_);
  for (int cell = 0; cell < n_cells(); ++cell) {
    std::vector<int>& nodes = nodes_of_cell[cell];
    for (int k = 0; k < nodes_per_cell_; ++k) {
      for (const NodeWeight& carrier : carriers(nodes_of(cell)[k])) {
        if (free_of_node_[carrier.node] >= 0) nodes.push_back(free_of_node_[carrier.node]);
      }
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    for (const int node : nodes) cells_of_node[node].push_back(cell);
  }
  numerics::BlockMatrix<3> matrix;
  matrix.n = n_free_;
  matrix.start = {0};
  std::vector<int> seen(n_free_, -1);
  for (int column = 0; column < n_free_; ++column) {
    const auto first = static_cast<std::ptrdiff_t>(matrix.row.size());
    for (const int cell : cells_of_node[column]) {
      for (const int row : nodes_of_cell[cell]) {
        if (row < column || seen[row] == column) continue;
        seen[row] = column;
        matrix.row.push_back(row);
      }
    }
    std::sort(matrix.row.begin() + first, matrix.row.end());
    matrix.start.push_back(static_cast<int>(matrix.row.size()));
  }
  matrix.value.assign(9 * matrix.row.size(), 0.0);
  return matrix;
}

void FreeNodes::add(int cell, const Eigen::MatrixXd& stiffness, numerics::BlockMatrix<3>& matrix,
                    const AddHeld& add_held) const {
  const auto add_block = [&](const NodeWeight& at_a, const NodeWeight& at_b, const auto& block) {
    const int row = free_of_node_[at_a.node];
    const int column = free_of_node_[at_b.node];
    if (row < 0 || (column >= 0 && row < column)) return;  // the lower triangle is kept
    const double weight = at_a.weight * at_b.weight;
    if (column < 0) {
      if (add_held) add_held(row, at_b.node, weight * block);
      return;
    }
    double* value = matrix.block(row, column);
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) value[3 * p + q] += weight * block(p, q);
    }
  };
  const int* nodes = nodes_of(cell);
  for (int b = 0; b < nodes_per_cell_; ++b) {
    for (int a = 0; a < nodes_per_cell_; ++a) {
      for (const NodeWeight& at_b : carriers(nodes[b])) {
        for (const NodeWeight& at_a : carriers(nodes[a])) add_block(at_a, at_b, stiffness.block<3, 3>(3 * a, 3 * b));
      }
    }
  }
}

std::vector<NodeWeight> FreeNodes::on_free_nodes(const std::vector<NodeWeight>& weights) const {
  std::vector<NodeWeight> free;
  for (const auto& [node, weight] : weights) {
    for (const NodeWeight& carrier : carriers(node)) {
      const int index = free_of_node_[carrier.node];
      if (index >= 0) free.push_back({index, weight * carrier.weight});
    }
  }
  merge(free);
  return free;
}

void merge(std::vector<NodeWeight>& weights) {
  std::sort(weights.begin(), weights.end(), [](const NodeWeight& a, const NodeWeight& b) { return a.node < b.node; });
  std::size_t last = 0;
  for (std::size_t k = 1; k < weights.size(); ++k) {
    if (weights[k].node == weights[last].node) {
      weights[last].weight += weights[k].weight;
    } else {
      weights[++last] = weights[k];
    }
  }
  if (!weights.empty()) weights.resize(last + 1);
}

std::vector<int> nodes_of(const WeightedNodes& points) {
  std::vector<int> nodes;
  for (const auto& point : points)
    for (const NodeWeight& w : point) nodes.push_back(w.node);
  return nodes;
}

MatrixXd solve_between(const numerics::SparseCholesky& factor, const WeightedNodes& from, Axes from_axes,
                       const MatrixXd& values, const WeightedNodes& to, Axes to_axes, const std::vector<int>& order) {
  MatrixXd answers = MatrixXd::Zero(to_axes.n * static_cast<Index>(to.size()), values.cols());
  const auto column_of = [&](int k) -> Index { return order.empty() ? k : order[k]; };
  factor.solve(
      static_cast<int>(values.cols()), nodes_of(to),
      [&](int k, const numerics::NodalColumn& b) { add_loads(from, from_axes, values.col(column_of(k)).data(), b); },
      [&](int k, const numerics::NodalColumn& u) { add_samples(to, to_axes, u, answers.col(column_of(k)).data()); });
  return answers;
}

}  // namespace mbtfm::elements
