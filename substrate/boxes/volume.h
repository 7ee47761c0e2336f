/// A finite element solution inside the gel, as boxes with values.
#pragma once

#include "substrate/boxes/elastic_system.h"
#include "substrate/compliance.h"

namespace mbtfm::boxes {

/// @param with_stress  mean over each box
substrate::VolumeField volume_field(const ElasticSystem& system, const substrate::Material& material,
                                    const numerics::NodalColumn& u, bool with_stress);

}  // namespace mbtfm::boxes
