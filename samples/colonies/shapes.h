/// Outlines of colonies and of cells on patterns, around the origin.
#pragma once

#include <vector>

#include "pipeline/contract/geometry.h"
#include "samples/colonies/parameters.h"

namespace mbtfm::colonies {

struct Outline {
  Polygon rim_um;
  std::vector<Polygon> adhesive_um;  ///< where it adheres; none: everywhere
};

/// disc: a circle. spikes: r(t) = R + a exp((cos n t − 1)/w), w so that a spike is half as high a half width beside its
/// middle. doublet-on-h: a square on the letter H, whose two sides between the bars sag inwards.
/// @throws UsageError where the pattern is no H, or spikes run into each other
Outline outline_of(const ColonyParameters& parameters);

}  // namespace mbtfm::colonies
