/// The dense part of a multifrontal factorisation.
#pragma once

#include <cstddef>

namespace mbtfm::network {

/// The first columns of a symmetric matrix, on and below its diagonal: `height` rows, `width` columns, column-major.
struct DenseColumns {
  double* values = nullptr;
  std::size_t height = 0, width = 0;
};

/// The first `width` steps of Cholesky's factorisation, in place. A pivot not above least_pivot[column] is replaced by
/// an infinite one. What is above the diagonal is overwritten.
/// @param change  out: what the height − width rows and columns that remain change by, column-major, on and below
///                their diagonal: minus the product of the new columns' lower rows with their transpose
/// Compiled for several instruction sets: the last bits depend on the processor, not on anything else.
void partial_cholesky(const DenseColumns& columns, const double* least_pivot, double* change);

}  // namespace mbtfm::network
