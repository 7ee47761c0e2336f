/// The dense parts of a multifrontal factorisation, and of solving with it. Compiled for several instruction sets with
/// the same sums and without fused multiplication: the bits are the same on every processor.
#pragma once

#include <cstddef>
#include <vector>

namespace mbtfm::numerics {

/// The first columns of a matrix, on and below its diagonal: `height` rows, `width` columns, column-major.
template <class Value>
struct DensePanel {
  Value* values = nullptr;
  std::size_t height = 0, width = 0;
};

/// The lower triangle of a symmetric matrix of n rows, in strips of columns: each strip begins with the row of its
/// first column, and is column-major. Little more than half of the square, in parts that the dense kernels take as they
/// are.
struct TriangleStrips {
  static constexpr std::size_t kColumns = 384;  // a multiple of 2 and of 3: no block is cut
  std::size_t n = 0;
  std::size_t stride(std::size_t column) const { return n - column / kColumns * kColumns; }
  /// Of a number of a column's strip.
  std::size_t at(std::size_t row, std::size_t column) const {
    const std::size_t first = column / kColumns * kColumns;  // the strips before it have n, n - kColumns, … rows
    return first * (n + kColumns / 2) - first * first / 2 + (column - first) * (n - first) + row - first;
  }
  std::size_t size() const { return at(n / kColumns * kColumns, n); }
};

/// What the functions below are compiled for.
enum class Instructions { baseline, avx2, avx512 };
std::vector<Instructions> known_instructions();  ///< to this processor, the fastest last
Instructions fastest_instructions();

/// The first `width` steps of Cholesky's factorisation, in place; float or double. A pivot not above
/// least_pivot[column] is replaced by an infinite one. What is above the diagonal is overwritten. Same bits for any
/// number of threads.
/// @param change  out: what the height − width rows and columns that remain change by, as TriangleStrips of which
///                what is on and below the diagonal counts: minus the product of the new columns' lower rows with
///                their transpose
template <class Real>
void partial_cholesky(const DensePanel<Real>& columns, const Real* least_pivot, Real* change, int threads = 1,
                      Instructions instructions = fastest_instructions());

/// Right-hand sides are rows of so many numbers, one row for each of the matrix: 1 number, or a multiple of this.
template <class Real>
constexpr std::size_t kRightHandSides = 64 / sizeof(Real);

/// With L₁ the first `width` rows of the factor, L₂ those below: (a, b) -> (L₁⁻¹ a, b − L₂ L₁⁻¹ a).
/// @param rows  `height` of them
template <class Real>
void solve_lower(const DensePanel<const Real>& factor, Real* rows, std::size_t n_right_hand_sides,
                 Instructions instructions = fastest_instructions());

/// (a, b) -> (L₁⁻ᵀ (a − L₂ᵀ b), b)
template <class Real>
void solve_upper(const DensePanel<const Real>& factor, Real* rows, std::size_t n_right_hand_sides,
                 Instructions instructions = fastest_instructions());

}  // namespace mbtfm::numerics
