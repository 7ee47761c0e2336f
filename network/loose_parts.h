/// Parts of a network that no adhesion holds: they would contract to a point and pull on nothing.
#pragma once

#include "pipeline/contract/types.h"

namespace mbtfm::network {

/// Leave out the parts that hang together by links of their own only and hold neither an adhesion nor a link of a
/// fibre, as the tip of a cell beyond a neck thinner than the mesh resolves. @return how many
int leave_out_loose_parts(Network& network);

}  // namespace mbtfm::network
