/// Cholesky factorisation of a symmetric matrix of 2×2 blocks (one per planar vertex) whose pattern stays while its
/// values change. Written out here, not Eigen's, for two reasons: a slack direction (a pivot that vanishes) must hold
/// still instead of failing, and whole blocks are three to four times as fast as single numbers.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace mbtfm::network {

class BlockCholesky {
 public:
  using Block = Eigen::Matrix2d;
  /// Right-hand sides, one in a column; rows 2i, 2i+1 belong to block i.
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Analyse the pattern: minimum-degree order, elimination tree, fill.
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
  std::size_t n_factor_blocks() const { return factor_.size(); }

 private:
  void order(const std::vector<std::array<int, 2>>& pairs);
  void store_rows(const std::vector<std::array<int, 2>>& pairs);
  void find_fill();

  std::vector<int> place_;  // of a block in the order of elimination
  struct Spring {
    int low, high, slot;
  };
  std::vector<Spring> springs_;  // by pair, in the order of elimination

  // The matrix: diagonal, and by row k the blocks left of it.
  std::vector<Block> diagonal_, off_diagonal_;
  std::vector<int> row_start_, row_column_;

  // The factor L: by row its columns, by column its rows and values; the inverse of each diagonal block.
  std::vector<int> pattern_start_, pattern_column_;
  std::vector<int> column_start_, column_row_;
  std::vector<Block> factor_, inverse_diagonal_;
};

}  // namespace mbtfm::network
