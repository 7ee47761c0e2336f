/// What kinds of cells there are: each has its own stages and its own report.
#pragma once

#include <array>

#include "pipeline/contract/words.h"

namespace mbtfm {

/// Where a cell's beads are followed, and what pulls at them.
enum class CellKind {
  plane,  ///< on a flat gel, by fibres: segment, track, network, fit
  space,  ///< in the volume of a gel, which may be curved: segment where there are images of the cell, track, surface,
          ///< traction
  sheet   ///< on a flat gel, by a contracting sheet: segment where there are images of the cell, track, sheet
};
constexpr auto words(CellKind) { return std::array{"plane", "space", "sheet"}; }

}  // namespace mbtfm
