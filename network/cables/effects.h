/// Whether a scene calls for stress fibres in its network, and for cables that resist being stretched.
#pragma once

#include <vector>

#include "network/cables/cables.h"
#include "pipeline/contract/cell.h"
#include "pipeline/stage/effects.h"

namespace mbtfm::cables {

/// Stress fibres: where the cell has any. Takes them out of the cell where they are off.
/// @throws InvalidData where they are switched on and there are none
Effect take_fibres(Cell& cell, Switch setting);

/// Part of all cables' force by which they resist being longer than at rest: 0 where elasticity changes nothing.
double stretch_share(const Network& network, const Equilibrium& equilibrium, double axial_stiffness_nN);

/// Elasticity of cables: where stretch_share at these tensions is above the tolerance.
Effect decide_elasticity(const CableNetwork& cables, const std::vector<double>& tensions_nN,
                         const stage::EffectSwitches& switches);

}  // namespace mbtfm::cables
