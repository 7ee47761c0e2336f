/// Displacements that a program wrote where it has none.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/beads.h"

namespace mbtfm::numerics {

struct Masked {
  std::size_t n = 0;                   ///< beads
  std::vector<std::string> values_um;  ///< that they share: "(0, 0)"
};

/// Flag beads as masked, and set them to zero, whose value many good beads share to the last digit in both components,
/// as a mask leaves it (0, −1, −9999).
///
/// Sound beads share values, too, where numbers have few digits. Then (a) the values one or a few steps beside are as
/// frequent, as far as noise alone decides; and (b) where the field comes to rest, it goes to the shared value in steps
/// of the last digit. A mask does neither: hardly a bead has a value near it, and at its rim the field jumps by many of
/// the steps that occur. Last, (c) a field that is held at its border has exact zeros there beside values of any size,
/// but these grow by as much again one place further on; beside a mask they do not grow.
Masked flag_masked(DisplacementField& field);

}  // namespace mbtfm::numerics
