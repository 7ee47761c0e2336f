/// Cholesky factorisation of a symmetric matrix of 2×2 blocks (one per planar vertex) whose pattern stays while its
/// values change. Multifrontal: columns that share their rows are a dense panel, and what a panel takes from the matrix
/// to its right is handed on to the next panel up the elimination tree (Liu, SIAM Review 34 (1992) 82).
///
/// Written out here for two reasons. A slack direction (a pivot that vanishes) must hold still, where CHOLMOD's panels
/// fail. And CHOLMOD takes more than three times as long at 1 200 to 20 000 vertices (benchmark_cables).
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

namespace mbtfm::numerics {

class BlockCholesky {
 public:
  using Block = Eigen::Matrix2d;
  /// Right-hand sides, one in a column; rows 2i, 2i+1 belong to block i.
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Analyse the pattern: fill-reducing order, elimination tree, panels. Copies share it.
  /// @param pairs  (i, j), i != j: the blocks off the diagonal that may be filled; repetitions share one block
  BlockCholesky(int n_blocks, const std::vector<std::array<int, 2>>& pairs);

  void set_zero();
  /// Add the stiffness of a spring between the two blocks of pairs[pair]: +K on their diagonals, −K between them.
  void add_spring(int pair, const Block& stiffness);
  /// Add to the diagonal block i.
  void add_diagonal(int i, const Block& stiffness);

  /// Factorise the present values with `shift` times their mean diagonal added to each diagonal block. A pivot lost in
  /// rounding (a direction without stiffness) is replaced by an infinite one: the direction does not move.
  void factorise(double shift = 0);
  /// Solve in place with the last factorisation.
  void solve(Columns& columns) const;

  int n_blocks() const { return static_cast<int>(diagonal_.size()); }

 private:
  struct Pattern;
  struct Panel;
  bool is_parent(const Panel& panel, const Panel& child) const;
  void assemble(const Panel& panel, double shift);
  enum class Part { columns, rest };
  void add_update(const Panel& child, const double* update, const Panel& panel, Part part, double* own_update);
  void eliminate(const Panel& panel, double* update, double shift);

  std::shared_ptr<const Pattern> pattern_;
  std::vector<Block> diagonal_, off_diagonal_;  // the matrix, in the order of elimination
  std::vector<double> factor_;                  // the panels, one after the other
  // Two stacks of what panels still have to hand on: a panel takes its children's from one and leaves its own on the
  // other.
  std::array<std::vector<double>, 2> updates_;
};

}  // namespace mbtfm::numerics
