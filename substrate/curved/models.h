/// The model of gels whose surface is not flat.
#pragma once

#include "substrate/curved/space.h"
#include "substrate/models.h"

namespace mbtfm::curved {

substrate::Model curved_gel();

/// A solution inside the gel: each cell as eight, straight between the nodes.
/// @param with_stress  in the middle of each
substrate::VolumeField volume_field(const Space& space, const Gel& gel, const Vectors& at_nodes_um, bool with_stress);

}  // namespace mbtfm::curved
