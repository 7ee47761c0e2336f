/// Holes of a field on a grid.
#pragma once

#include <optional>
#include <vector>

namespace mbtfm::numerics {

/// The values, row by row, with a plate of least bending energy through them in place of each that is not a number:
/// the smoothest field that goes on with the values and slopes around a hole. Nothing if too few values hold the plate.
/// @param dx, dy  distances of columns and of rows
std::optional<std::vector<double>> plate_through(std::vector<double> values, int n_columns, double dx, double dy);

}  // namespace mbtfm::numerics
