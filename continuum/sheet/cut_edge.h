/// Where the image ends before the sheet does: what holds the sheet there.
#pragma once

#include <array>
#include <vector>

#include "continuum/sheet/elements.h"

namespace mbtfm::sheet {

/// What is taken for known along a cut, of which nothing is known.
enum class CutEdge {
  held,     ///< no displacement across the cut, no shear: as where the sheet beyond mirrors what is seen
  clamped,  ///< no displacement at all
  free      ///< as a rim: nothing pulls there
};

/// The sheet's hold at its cuts.
struct CutHold {
  std::vector<std::array<bool, 2>> held;  ///< by node, along x and y; empty: nowhere
  std::array<bool, 2> holds{};            ///< the sheet as a whole, along x and y
  double length_um = 0;                   ///< of all cuts
  bool is_anywhere() const { return holds[0] || holds[1]; }
};
/// @param region  whose cuts run along x or along y, as an image's border does
/// @throws InvalidData where one does not
CutHold hold_at_cuts(const Elements& elements, const Region& region, CutEdge edge);

}  // namespace mbtfm::sheet
