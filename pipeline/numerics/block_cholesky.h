/// Cholesky factorisation of a symmetric matrix of kBlock × kBlock blocks whose pattern stays while its values change.
/// Multifrontal: columns that share their rows are a dense panel, and what a panel takes from the matrix to its right
/// is handed on to the next panel up the elimination tree (Liu, SIAM Review 34 (1992) 82).
///
/// Written out here for three reasons. A slack direction (a pivot that vanishes) may have to hold still, where
/// CHOLMOD's panels fail. CHOLMOD takes more than three times as long at 1 200 to 20 000 vertices (benchmark_cables).
/// And the bits depend neither on the number of threads nor on the kernels that a BLAS chooses.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "pipeline/numerics/elimination.h"

namespace mbtfm::numerics {

/// The lower triangle of a symmetric matrix of n × n blocks.
template <int kBlock>
struct BlockMatrix : BlockPattern {
  std::vector<double> value;  ///< kBlock² a block, row by row
  /// The block of the pattern at row >= column.
  double* block(int at_row, int column) {
    return &value[kBlock * kBlock * static_cast<std::size_t>(slot(at_row, column))];
  }
};

/// What becomes of a pivot lost in rounding (a direction without stiffness): the matrix is refused, or an infinite one
/// represents it: the direction does not move.
enum class LostPivot { fails, holds_still };

struct FactoriseOptions {
  LostPivot lost_pivot = LostPivot::fails;
  double shift = 0;  ///< added to the diagonal
  int threads = 1;
};

template <int kBlock, class Real>  // 2 and double, 3 and double or float
class BlockCholesky {
 public:
  using Numbers = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

  explicit BlockCholesky(std::shared_ptr<const Elimination> elimination) : elimination_(std::move(elimination)) {}

  /// Stage by stage, subtrees run side by side, and the panels above them one after the other, cut into tiles. Neither
  /// depends on the number of threads, so the bits do not. @returns whether no pivot was lost that must not be
  bool factorise(const BlockMatrix<kBlock>& matrix, const FactoriseOptions& options);

  /// In place, with the last factorisation. Skips the panels below which no right-hand side is.
  /// @param x         rows in the order of elimination, each of n numbers
  /// @param n         1, or a multiple of kRightHandSides
  /// @param is_needed by panel: whether its solution is, and with it those of the panels above; empty: all are
  void solve(Real* x, std::size_t n, const std::vector<char>& is_needed = {}) const;

  const Elimination& elimination() const { return *elimination_; }
  /// The panels, one after the other, column-major.
  Numbers& factor() { return factor_; }
  const Numbers& factor() const { return factor_; }

 private:
  using Panel = EliminationPanel;
  using Updates = std::vector<Real*>;  // by panel: what it hands on
  static std::size_t update_size(const Panel& panel) { return panel.n_update_numbers(kBlock); }
  bool factorise_in_a_row(const BlockMatrix<kBlock>& matrix, const FactoriseOptions& options);
  bool factorise_side_by_side(const BlockMatrix<kBlock>& matrix, const FactoriseOptions& options);
  bool eliminate(const Panel& panel, const BlockMatrix<kBlock>& matrix, const FactoriseOptions& options,
                 const Updates& updates);
  void assemble(const Panel& panel, const BlockMatrix<kBlock>& matrix, const FactoriseOptions& options);
  void add_updates(const Panel& panel, bool to_columns, const Updates& updates, int threads);
  Real* values_of(const Panel& panel) { return factor_.data() + kBlock * kBlock * panel.at; }

  std::shared_ptr<const Elimination> elimination_;
  Numbers factor_;
};

}  // namespace mbtfm::numerics
