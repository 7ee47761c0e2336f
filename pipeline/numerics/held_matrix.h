/// The stiffness of a mesh's nodes, a block of kBlock × kBlock for each two of one element, and its factor. Some
/// components are held: they do not move. The pattern stays while values change; copies share the order of elimination.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "pipeline/numerics/block_cholesky.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/dense_panel.h"

namespace mbtfm::numerics {

template <int kBlock>
class HeldMatrix {
 public:
  using Held = std::vector<std::array<bool, kBlock>>;  ///< by node and component

  /// @param nodes  those of an element after those of another; a node may be there twice
  /// @param held   empty: nothing is
  HeldMatrix(int n_nodes, std::vector<int> nodes, int per_element, Held held)
      : nodes_(std::move(nodes)), per_element_(per_element), held_(std::move(held)) {
    if (held_.empty()) held_.assign(static_cast<std::size_t>(n_nodes), {});
    std::vector<std::vector<int>> below(n_nodes);
    for (int e = 0; e < n_elements(); ++e) for_each_pair(e, [&](int row, int column) { below[column].push_back(row); });
    matrix_.n = n_nodes;
    matrix_.start = {0};
    for (std::vector<int>& rows : below) {
      std::ranges::sort(rows);
      rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
      matrix_.row.insert(matrix_.row.end(), rows.begin(), rows.end());
      matrix_.start.push_back(static_cast<int>(matrix_.row.size()));
    }
    for (int e = 0; e < n_elements(); ++e) {
      first_slot_.push_back(slots_.size());
      for_each_pair(e, [&](int row, int column) { slots_.push_back(matrix_.slot(row, column)); });
    }
    factor_ = Factor(std::make_shared<const Elimination>(matrix_, Search::quick));
  }

  bool is_held(int node, int component) const { return held_[node][component]; }
  /// Of matrix and factor.
  double n_numbers() const {
    return factor_.elimination().most_numbers(kBlock) + kBlock * kBlock * static_cast<double>(matrix_.row.size());
  }

  void set_zero() { matrix_.value.assign(kBlock * kBlock * matrix_.row.size(), 0.0); }

  /// @param stiffness  of row and column kBlock k + i: component i of the element's node k
  template <class Stiffness>
  void add(int element, const Stiffness& stiffness) {
    const int* nodes = &nodes_[static_cast<std::size_t>(element) * per_element_];
    const int* slot = &slots_[first_slot_[element]];
    for (int k = 0; k < per_element_; ++k) {
      for (int l = 0; l < per_element_; ++l) {
        if (nodes[k] < nodes[l]) continue;  // the lower triangle is kept
        double* block = &matrix_.value[kBlock * kBlock * static_cast<std::size_t>(*slot++)];
        for (int i = 0; i < kBlock; ++i) {
          for (int j = 0; j < kBlock; ++j) {
            if (held_[nodes[k]][i] || held_[nodes[l]][j]) continue;
            block[kBlock * i + j] += stiffness(kBlock * k + i, kBlock * l + j);
          }
        }
      }
    }
  }

  /// What is held has an equation of its own: no displacement.
  /// @param shift  times the mean diagonal, added to the diagonal
  /// @returns whether it is positive definite
  bool factorise(double shift = 0, int threads = 1) {
    const double mean = mean_diagonal();
    for (int node = 0; node < matrix_.n; ++node) {
      for (int i = 0; i < kBlock; ++i)
        if (held_[node][i]) diagonal(node)[(kBlock + 1) * i] = mean;
    }
    return factor_.factorise(matrix_, {.shift = shift * mean, .threads = threads});
  }

  /// With the last factor; what is held stays. @param forces  kBlock·nodes × any number
  MatrixXd solve(const MatrixXd& forces) const {
    constexpr Index kAtATime = kRightHandSides<double>;
    const Index n_given = forces.cols(), n = n_given == 1 ? 1 : (n_given + kAtATime - 1) / kAtATime * kAtATime;
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> in_order =
        decltype(in_order)::Zero(forces.rows(), n);
    const std::vector<int>& place = factor_.elimination().place;
    const auto row_of = [&](int node, int i) { return kBlock * static_cast<Index>(place[node]) + i; };
    for (int node = 0; node < matrix_.n; ++node) {
      for (int i = 0; i < kBlock; ++i)
        if (!held_[node][i]) in_order.row(row_of(node, i)).leftCols(n_given) = forces.row(kBlock * node + i);
    }
    factor_.solve(in_order.data(), static_cast<std::size_t>(n));
    MatrixXd u(forces.rows(), n_given);
    for (int node = 0; node < matrix_.n; ++node) {
      for (int i = 0; i < kBlock; ++i) u.row(kBlock * node + i) = in_order.row(row_of(node, i)).leftCols(n_given);
    }
    return u;
  }

 private:
  using Factor = BlockCholesky<kBlock, double>;

  int n_elements() const { return static_cast<int>(nodes_.size()) / per_element_; }
  /// body(row, column) of the lower triangle's blocks, as add() meets them.
  template <class Body>
  void for_each_pair(int element, const Body& body) const {
    const int* nodes = &nodes_[static_cast<std::size_t>(element) * per_element_];
    for (int k = 0; k < per_element_; ++k) {
      for (int l = 0; l < per_element_; ++l)
        if (nodes[k] >= nodes[l]) body(nodes[k], nodes[l]);
    }
  }
  double* diagonal(int node) { return &matrix_.value[kBlock * kBlock * static_cast<std::size_t>(matrix_.start[node])]; }
  double mean_diagonal() {
    double sum = 0;
    for (int node = 0; node < matrix_.n; ++node) {
      for (int i = 0; i < kBlock; ++i) sum += diagonal(node)[(kBlock + 1) * i];
    }
    return sum / (kBlock * matrix_.n);
  }

  std::vector<int> nodes_;
  int per_element_;
  Held held_;
  BlockMatrix<kBlock> matrix_;
  std::vector<int> slots_;               ///< in the matrix, of the pairs of each element
  std::vector<std::size_t> first_slot_;  ///< by element
  Factor factor_{nullptr};
};

}  // namespace mbtfm::numerics
