/// The first places of the vertices between the lines of a frame.
#pragma once

#include <string>
#include <vector>

#include "network/mesh/frame.h"

namespace mbtfm::mesh {

/// Points at about the wanted distances, in the box of the frame and clear of its lines:
/// "regular": a triangular lattice, turned and shifted at random, finer by powers of √3 where that is wanted;
/// "jittered": the same, each point moved at random;
/// "poisson": points at random, none nearer to another than 0.76 of the wanted distance (Poisson discs).
std::vector<Vec2> places_of_seeds(const Frame& frame, const std::string& kind, Random& random);

}  // namespace mbtfm::mesh
