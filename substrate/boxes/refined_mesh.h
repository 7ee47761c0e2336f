/// The mesh of `refined`: how fine around each adhesion, how coarse far from all of them.
#pragma once

#include "substrate/boxes/block_mesh.h"
#include "substrate/ellipse.h"
#include "substrate/material.h"
#include "substrate/scene.h"

namespace mbtfm::boxes {

struct Fineness {
  double across = 1.4;        ///< square root of an ellipse's area over the largest side of an element on it
  int fewest_elements = 4;    ///< that touch an ellipse
  double growth = 4;          ///< of a side over its distance to the nearest ellipse, at most
  std::vector<int> halvings;  ///< by ellipse: of the side that follows; below 0: doublings
};

/// @throws NotSolved where it would have more than `most_cells`
BlockMesh refined_mesh(const substrate::Material& material, const substrate::Extent& scene,
                       const std::vector<substrate::Ellipse>& ellipses, const Fineness& fineness, double margin_um,
                       int order, std::int64_t most_cells, int threads);

}  // namespace mbtfm::boxes
