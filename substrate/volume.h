/// A finite element solution inside the gel, as boxes with values.
#pragma once

#include "substrate/elastic_system.h"

namespace mbtfm::substrate {

/// @param with_stress  of each box at its centre, the pressure being the element's own
VolumeField volume_field(const ElasticSystem& system, const Material& material, const NodalColumn& u, bool with_stress);

}  // namespace mbtfm::substrate
