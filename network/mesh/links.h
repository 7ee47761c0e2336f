/// The cables of a mesh: which vertices they join, and the width of material each represents.
#pragma once

#include <vector>

#include "network/mesh/frame.h"
#include "network/mesh/relax.h"

namespace mbtfm::mesh {

/// Links of all edges, one of each fibre that runs along it, else one of the actin network; and, with
/// `link_reach = "second-neighbours"`, of the vertices across from each other at an edge that nothing runs along.
/// Together they pull on the vertices as a sheet of even surface tension does (docs/theory/network.md, (4) and (4a)).
std::vector<Link> links_of(const Frame& frame, const RelaxedMesh& mesh, const NetworkParameters& parameters);

}  // namespace mbtfm::mesh
