/// Which adhesions hold a fibre.
#pragma once

#include <vector>

#include "pipeline/contract/types.h"

namespace mbtfm::segment {

/// Tie each end to the adhesion it reaches: an adhesion near the end, on the line's own course, whose rim is not
/// further than `reach_um`; nearest first. A tied end is led to the adhesion's centre. Sets the type by the number of
/// tied ends and its confidence: the chance that neither end's decision would change if the end moved by a third of the
/// reach. Both ends never share an adhesion; the nearer one has it.
void tie_ends(Fibre& fibre, const std::vector<Adhesion>& adhesions, double reach_um);

}  // namespace mbtfm::segment
