/// Whether a scene calls for stress fibres in its network, and for cables that resist stretching.
#pragma once

#include <string>
#include <vector>

#include "network/cables.h"

namespace mbtfm::network {

/// Whether the network has stress fibres: where the cell has any. Takes them out of the cell where it has not.
/// @throws InvalidData where they are switched on and there are none
Effect take_fibres(Cell& cell, const std::string& setting);

/// How far cables would be stretched if nothing held them back: sum over the cables longer than at rest of
/// share · EA · strain, over the same sum of the forces they pull with. With EA far above the tensions this is far above
/// the change of the adhesion forces, of which it is an upper bound: the stretch that EA allows is smaller.
/// @param cables  with axial_stiffness_nN = 0
double free_stretch(const CableNetwork& cables, const std::vector<double>& tensions_nN, double axial_stiffness_nN);

/// Whether cables resist being longer than at rest: where for any of these sets of tensions free_stretch is above the
/// tolerance.
Effect decide_elasticity(const Network& network, const CableParameters& parameters,
                         const std::vector<std::vector<double>>& tensions_nN, const EffectSwitches& switches);

}  // namespace mbtfm::network
