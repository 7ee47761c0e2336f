/// Sparse Cholesky factorisation of 3 x 3 block matrices (CHOLMOD, supernodal, nested dissection of the nodes).
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

namespace mbtfm::substrate {

/// The lower triangle of a symmetric matrix of n x n blocks of 3 x 3, by block columns.
struct BlockMatrix {
  int n = 0;
  std::vector<int> start;     ///< by column, n + 1
  std::vector<int> row;       ///< block rows, rising, the first of a column its diagonal
  std::vector<double> value;  ///< 9 a block, row by row
  /// The block of the pattern at row >= column.
  double* block(int at_row, int column) {
    const auto found = std::lower_bound(row.begin() + start[column], row.begin() + start[column + 1], at_row);
    return &value[9 * static_cast<std::size_t>(found - row.begin())];
  }
};

class SparseCholesky {
 public:
  /// @param blas_threads  of the factorisation; another number rounds differently, so only 1 gives the same bits for
  ///                      any `threads`
  /// @throws NotSolved where the factor would take more than `memory_limit_GB` (known before it is allocated), or the
  ///         matrix is not positive definite
  SparseCholesky(const BlockMatrix& matrix, int threads, int blas_threads, double memory_limit_GB);
  ~SparseCholesky();
  SparseCholesky(const SparseCholesky&) = delete;
  SparseCholesky& operator=(const SparseCholesky&) = delete;

  /// For each column: fill(column, b) sets the right-hand side (3 n values, zero before), take(column, x) uses the
  /// solution. Both run concurrently for different columns.
  void solve(int n_columns, const std::function<void(int, double*)>& fill,
             const std::function<void(int, const double*)>& take) const;
  double factor_GB() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mbtfm::substrate
