/// The stiffness of springs between points of the plane, a block of 2 × 2 for each point, and its factor. Its pattern
/// stays while its values change; copies share it.
#pragma once

#include <array>
#include <vector>

#include "pipeline/numerics/block_cholesky.h"

namespace mbtfm::numerics {

/// A matrix of zeros with the diagonal and these blocks below it.
/// @param pairs  (i, j), i != j, in any order; repetitions share one block
BlockMatrix<2> matrix_of_pairs(int n_blocks, const std::vector<std::array<int, 2>>& pairs);

class SpringMatrix {
 public:
  using Block = Eigen::Matrix2d;
  /// Right-hand sides, one in a column; rows 2i, 2i+1 belong to block i.
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// @param pairs  (i, j), i != j: the blocks off the diagonal that may be filled; repetitions share one block
  SpringMatrix(int n_blocks, const std::vector<std::array<int, 2>>& pairs);

  void set_zero();
  /// Add the stiffness of a spring between the two blocks of pairs[pair]: +K on their diagonals, −K between them.
  void add_spring(int pair, const Block& stiffness);
  /// Add to the diagonal block i.
  void add_diagonal(int i, const Block& stiffness);

  /// Factorise the present values with `shift` times their mean diagonal added to each diagonal block. A direction
  /// without stiffness does not move.
  void factorise(double shift = 0);
  /// Solve in place with the last factorisation.
  void solve(Columns& columns) const;

  int n_blocks() const { return matrix_.n; }

 private:
  struct Spring {
    int low, high, between;  // slots
  };
  Eigen::Map<Block> block(int slot) { return Eigen::Map<Block>(matrix_.value.data() + 4 * slot); }

  BlockMatrix<2> matrix_;
  std::vector<Spring> springs_;  // by pair
  BlockCholesky<2, double> factor_;
};

}  // namespace mbtfm::numerics
