/// A finite element solution inside the gel, as boxes with values.
#pragma once

#include "substrate/elastic_system.h"

namespace mbtfm::substrate {

/// @param with_stress  mean over each box
VolumeField volume_field(const ElasticSystem& system, const Material& material, const NodalColumn& u, bool with_stress);

}  // namespace mbtfm::substrate
