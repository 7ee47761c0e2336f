/// The factor of a matrix of 3 x 3 blocks, made once for many right-hand sides: in single or double precision, within a
/// limit of memory, kept on disk.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/numerics/block_cholesky.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::numerics {

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
  SparseCholesky(const BlockMatrix<3>& matrix, const FactorOptions& options);
  /// @param elimination  of a matrix with the same pattern
  SparseCholesky(const BlockMatrix<3>& matrix, const FactorOptions& options,
                 std::shared_ptr<const Elimination> elimination);
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
