/// Draws cells: outline, adhesions, stress fibres and the tensions of these.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/cell.h"
#include "samples/drawing/scenario.h"

namespace mbtfm::drawing {

struct DrawnCell {
  Cell cell;                        ///< mean_intensity is the brightness, 1 on average
  std::vector<double> tensions_nN;  ///< of cell.fibres, in their order
};

/// A cell in the middle of a square field. No two adhesions touch, none lies on a fibre but those that hold its ends,
/// and all lie inside the outline.
/// @throws UsageError where the parameters leave no room for what they ask for
DrawnCell draw_cell(const CellParameters& parameters, const TensionParameters& tension, double field_um,
                    std::uint64_t seed);

}  // namespace mbtfm::drawing
