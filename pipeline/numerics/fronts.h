/// Dense parts of a sparse Cholesky factorisation: multifrontal, on the supernodes found before.
#pragma once

#include <memory>
#include <vector>

#include "pipeline/numerics/cholesky.h"

namespace mbtfm::numerics {

/// What each group of columns with the same rows below holds, in blocks of 3 x 3: columns in the order of elimination.
struct Supernodes {
  std::vector<int> first;      ///< its first column, one more at the end
  std::vector<int> row_start;  ///< its first entry in `row`, one more at the end
  std::vector<int> row;        ///< its rows, rising: its own columns, then those below
  std::vector<int> parent;     ///< the one that holds its first row below; -1: a root
  std::vector<int> place;      ///< by node of the matrix: its column

  int count() const { return static_cast<int>(parent.size()); }
  int n_columns(int s) const { return first[s + 1] - first[s]; }
  int n_rows(int s) const { return row_start[s + 1] - row_start[s]; }
  const int* rows(int s) const { return &row[row_start[s]]; }
};

/// The factor: by supernode its columns, each with the rows of the supernode, as one dense matrix of 3 n_rows(s) rows.
template <class Real>
using Panels = std::vector<std::unique_ptr<Real[]>>;

/// The most numbers that factor and fronts take at a time, for any number of threads.
double most_numbers(const Supernodes& supernodes);

/// Subtrees run side by side; the fronts above them one after the other, cut into tiles. Neither depends on the number
/// of threads, so the bits do not. @return false where the matrix is not positive definite to rounding
template <class Real>  // float or double
bool factorise(const BlockMatrix& matrix, const Supernodes& supernodes, int threads, Panels<Real>& panels);

/// Solve L L^T x = b for k right-hand sides at a time, x over b: column-major, a column for each unknown in the order
/// of elimination, k rows. Skips the supernodes below which no b is, and those above which no x is needed.
template <class Real>
void solve_panels(const Supernodes& supernodes, const Panels<Real>& panels, const std::vector<char>& is_needed, int k,
                  Real* b);

}  // namespace mbtfm::numerics
