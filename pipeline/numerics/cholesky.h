/// Sparse Cholesky factorisation of matrices of 3 x 3 blocks: nested dissection of the nodes (METIS) and supernodes by
/// CHOLMOD, fronts by our own, whose bits do not depend on the number of threads.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace mbtfm::numerics {

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

/// One column of a right-hand side or a solution, by node and axis.
class NodalColumn {
 public:
  NodalColumn(double* first, int stride, const std::vector<int>& place)
      : first_(first), stride_(stride), place_(&place) {}
  double& operator()(int node, int axis) const {
    return first_[(3 * static_cast<std::size_t>((*place_)[node]) + axis) * stride_];
  }

 private:
  double* first_;
  std::size_t stride_;
  const std::vector<int>* place_;
};

/// How the numbers of the factor are kept. `single_`: 7 digits, of which the condition of the matrix takes its share;
/// half the memory, nearly twice the speed.
enum class Precision { single_, double_ };
constexpr auto words(Precision) { return std::array{"single", "double"}; }

struct FactorOptions {
  int threads = 1;
  double memory_limit_GB = 0;
  Precision precision = Precision::double_;
  std::string cache_folder = {};  ///< where a double factor is read from, or left; empty: nowhere
};

class SparseCholesky {
 public:
  /// A file of the cache is called by the hash of the matrix, so it is never that of another; a damaged one is ignored.
  /// @throws NotSolved where the factor would take more than the memory allowed (known before it is allocated), or the
  ///         matrix is not positive definite
  SparseCholesky(const BlockMatrix& matrix, const FactorOptions& options);
  ~SparseCholesky();
  SparseCholesky(const SparseCholesky&) = delete;
  SparseCholesky& operator=(const SparseCholesky&) = delete;

  /// For each column: fill(column, b) sets the right-hand side, zero before; take(column, x) uses the solution, which
  /// is right at the nodes of `needed` (rising or not) alone. Both run concurrently for different columns. Cheapest
  /// where neighbouring columns are loaded near each other.
  using Use = std::function<void(int column, const NodalColumn& values)>;
  void solve(int n_columns, const std::vector<int>& needed, const Use& fill, const Use& take) const;
  double factor_GB() const;
  /// What became of the file in the cache; empty where there is no cache.
  const std::string& cache_note() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mbtfm::numerics
