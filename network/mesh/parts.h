/// Parts of a network: what hangs together by links.
#pragma once

#include <vector>

#include "pipeline/contract/network.h"

namespace mbtfm::mesh {

int count_parts(const Network& network);

/// Leave out the other vertices, and links from them; those that stay keep their order.
void keep_vertices(Network& network, const std::vector<char>& is_kept);

/// Leave out the parts that hang together by links of their own only and hold neither an adhesion nor a link of a
/// fibre, as the tip of a cell beyond a neck thinner than the mesh resolves: they would contract to a point and pull on
/// nothing. @return how many
int leave_out_loose_parts(Network& network);

}  // namespace mbtfm::mesh
