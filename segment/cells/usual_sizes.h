/// How large a cell, its adhesions and its fibres are beside those of other cells.
#pragma once

namespace mbtfm::cells {

struct Segmentation;

/// A wrong pixel size makes all lengths wrong by one factor.
struct SizeRatio {
  double ratio = 1;  ///< of this cell's lengths to the usual ones
  double z = 0;      ///< its logarithm over the scatter among cells; 0 also if there is nothing to compare
};

/// Mean logarithm of the cell's width, the adhesions' width and the fibres' width over the usual ones, weighed by how
/// much cells differ in each. What was assumed, or is cut by the image, does not count.
SizeRatio size_ratio(const Segmentation& segmentation);

}  // namespace mbtfm::cells
