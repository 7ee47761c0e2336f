/// The first places of the vertices between the lines of a frame.
#pragma once

#include <vector>

#include "network/mesh/frame.h"

namespace mbtfm::mesh {

/// Points at about the wanted distances, in the box of the frame and clear of its lines: a triangular lattice, turned
/// and shifted at random, each point moved at random. It is finer by powers of √3 where that is wanted.
std::vector<Vec2> places_of_seeds(const Frame& frame, Random& random);

}  // namespace mbtfm::mesh
