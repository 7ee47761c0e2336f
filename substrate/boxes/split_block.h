/// The block and coarse grid of `split`: made for a gel and the part of its surface that a scene covers.
#pragma once

#include <array>
#include <memory>

#include "substrate/boxes/elastic_system.h"
#include "substrate/compliance.h"
#include "substrate/scene.h"

namespace mbtfm::boxes {

/// Indices of the squares, of side thickness / cells_per_thickness, that the scene covers.
using Squares = std::array<int, 4>;

/// A quadrature point of a side of the block.
struct SidePoint {
  std::array<double, 3> position_um;
  int normal_axis;
  double area_um2;  ///< with the sign of the outward normal
  std::vector<NodeWeight> weights;
};

/// Where a grid lies: the squares that are cut alike, and the sides.
struct Footprint {
  Squares squares;
  substrate::Extent outer;
};
bool operator==(const Footprint& a, const Footprint& b);

struct SplitBlock {
  Footprint footprint;
  ElasticSystem system;
  std::vector<SidePoint> side_points;
};

/// @throws NotSolved where the gel is so thin beside the scene that no grid of it fits
Footprint footprint_of(const substrate::Extent& scene, const Gel& gel,
                       const substrate::SubstrateParameters& parameters);

/// @throws NotSolved where memory would not suffice
std::unique_ptr<SplitBlock> make_split_block(const Footprint& footprint, const Gel& gel,
                                             const substrate::SubstrateParameters& parameters, int threads);

}  // namespace mbtfm::boxes
