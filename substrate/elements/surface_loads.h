/// What loads the surface of a gel's block, as forces on the nodes of its mesh.
#pragma once

#include "substrate/elements/space.h"
#include "substrate/loads.h"

namespace mbtfm::elements {

/// A rectangle of the surface, seen from above, and the side that cells on it should have.
struct Target {
  Vec2 low_um, high_um;
  double side_um = 0;
};

/// Where the loads are. @param across  square root of an ellipse's area, or a square's or quad's side, over the side of
///                                     the cells that carry it
/// @throws UsageError where they are waves, which have no end, InvalidData where a shape is none, or a quad no
/// rectangle
std::vector<Target> targets_of(const substrate::Loads& loads, double across);

/// Cells of the surface that an ellipse touches.
std::vector<int> touched_cells(const Block& block, const substrate::Ellipse& ellipse);

/// By load: the force on each free node along an axis, for a unit load along it. Tractions act on the area of the
/// curved surface. @throws InvalidData where a part of a load lies outside the block
WeightedNodes load_weights(const Block& block, const Space& space, const substrate::Loads& loads);

/// A gel's block with its equations, its loads and its points.
struct System {
  Block block;
  Space space;
  WeightedNodes loads, points;
  std::shared_ptr<const numerics::SparseCholesky> factor =
      nullptr;  ///< of small strains; null where nobody asks for it

  /// @throws InvalidData where a load or a point lies outside the block
  System(Block made, const substrate::Loads& of, const substrate::Observations& at, int threads);
};

}  // namespace mbtfm::elements
