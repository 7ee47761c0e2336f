/// Cells of one shape, laid onto a reference; which cells do not belong there.
#pragma once

#include <string>
#include <vector>

#include "mbtfm/mean/images.h"
#include "mbtfm/mean/outputs.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/words.h"

namespace mbtfm::mean {

/// What the folder of a cell holds.
struct Cell {
  std::string name;
  Path outline_file;
  Polygon outline_um;
  DisplacementField beads;
  Gel gel;
  Brightness image = {};  ///< where it is registered by images
};

struct Alignment {
  Polygon reference_um;
  std::vector<Motion> motions;  ///< of the reference's symmetry, the identity first
  Mirrors mirrors = Mirrors::not_tried;
  double largest_misfit = 0.1;  ///< of the reference's size
};

/// The outline that lies nearest to all others: that of the least sum of squared misfits.
int most_typical(const std::vector<Polygon>& outlines_um, Mirrors mirrors, int threads);

/// Whether mirrors are tried: as the switch says, or where the reference is not its own mirror image.
Mirrors mirrors_for(Switch setting, const Polygon& reference_um);

/// @throws UsageError where the reference does not have the symmetry
void expect_symmetric(const Alignment& alignment, const std::string& symmetry);

/// Each cell's best way onto the reference; those that do not fit are marked, with the reason.
/// @param image  of the reference, to lay the cells' images onto; the outlines then tell how well they fit, and which
/// cells have another shape
std::vector<CellRow> aligned(const std::vector<Cell>& cells, const Alignment& alignment, int threads,
                             const Brightness* image = nullptr);

}  // namespace mbtfm::mean
