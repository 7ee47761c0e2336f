/// Height maps of pictures: coarser ones, and vertices without a height.
#pragma once

#include "pipeline/contract/surface.h"

namespace mbtfm::surface {

/// Means of blocks of `factor` x `factor` vertices; NaN where half of a block or more is missing.
/// @throws InvalidData where fewer than 4 x 4 blocks fit
HeightMap binned(const HeightMap& map, int factor);

struct FilledMap {
  HeightMap map;
  int n_filled = 0;
};

/// Gives vertices without a height (NaN) one: the plate that bends least, held by its neighbours.
/// @param widest_um  of the greatest disc within a hole
/// @throws InvalidData where a hole is wider, by place
FilledMap filled(HeightMap map, double widest_um);

}  // namespace mbtfm::surface
