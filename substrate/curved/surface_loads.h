/// What loads the surface of a gel's block, as forces on the nodes of its mesh.
#pragma once

#include "substrate/curved/space.h"
#include "substrate/loads.h"

namespace mbtfm::curved {

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

/// By load: the force on each free node along an axis, for a unit load along it. Tractions act on the area of the
/// curved surface. @throws InvalidData where a part of a load lies outside the block
std::vector<std::vector<boxes::NodeWeight>> load_weights(const Block& block, const Space& space,
                                                         const substrate::Loads& loads);

}  // namespace mbtfm::curved
