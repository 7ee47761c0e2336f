/// The dense parts of a multifrontal factorisation, and of solving with it. Compiled for several instruction sets: the
/// last bits depend on the processor, not on anything else.
#pragma once

#include <cstddef>

namespace mbtfm::numerics {

/// The first columns of a matrix, on and below its diagonal: `height` rows, `width` columns, column-major.
template <class Value>
struct DensePanel {
  Value* values = nullptr;
  std::size_t height = 0, width = 0;
};
/// Of a symmetric matrix.
using DenseColumns = DensePanel<double>;
/// What partial_cholesky() leaves of them.
using DenseFactor = DensePanel<const double>;

/// The first `width` steps of Cholesky's factorisation, in place. A pivot not above least_pivot[column] is replaced by
/// an infinite one. What is above the diagonal is overwritten.
/// @param change  out: what the height − width rows and columns that remain change by, column-major, on and below
///                their diagonal: minus the product of the new columns' lower rows with their transpose
void partial_cholesky(const DenseColumns& columns, const double* least_pivot, double* change);

/// Right-hand sides are rows of so many numbers, one row for each of the matrix: 1 number, or a multiple of this.
constexpr std::size_t kRightHandSides = 8;

/// With L₁ the first `width` rows of the factor, L₂ those below: (a, b) -> (L₁⁻¹ a, b − L₂ L₁⁻¹ a).
/// @param rows  `height` of them
void solve_lower(const DenseFactor& factor, double* rows, std::size_t n_right_hand_sides);

/// (a, b) -> (L₁⁻ᵀ (a − L₂ᵀ b), b)
void solve_upper(const DenseFactor& factor, double* rows, std::size_t n_right_hand_sides);

}  // namespace mbtfm::numerics
