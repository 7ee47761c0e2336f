/// The thesis' way to a trial's misfit: its displacements are solved for afresh (3.2.5). For comparison.
#pragma once

#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_problem.h"
#include "substrate/compliance.h"

namespace mbtfm::tensions {

/// One solution at a time, as the substrate has threads of its own.
/// @param substrate  must outlive the function
SolvedMisfit solved_misfit(const substrate::Substrate& substrate, std::vector<Vec2> points_um,
                           std::vector<substrate::Ellipse> ellipses, LinearData data);

}  // namespace mbtfm::tensions
