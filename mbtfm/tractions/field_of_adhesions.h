/// What adhesions that pull make of all beads, as far as some of the beads tell.
#pragma once

#include <vector>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/cell.h"

namespace mbtfm::tractions {

/// Displacements (um) of all beads by a force on each adhesion and a common affine motion, which explain those without
/// a flag best: Tukey's loss, so that beads that are astray do not count. To guess by, near adhesions: the gel is taken
/// for a thick, incompressible layer. Empty where there are not twice as many data as unknowns.
std::vector<Vec2> field_of_adhesions_um(const std::vector<Adhesion>& adhesions, const DisplacementField& beads,
                                        int threads);

}  // namespace mbtfm::tractions
