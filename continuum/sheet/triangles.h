/// Quadratic triangles fitted to outlines: curved along them, small where they must be, growing away from there.
#pragma once

#include <array>
#include <vector>

#include "continuum/sheet/curve.h"
#include "pipeline/contract/cell.h"

namespace mbtfm::sheet {

struct Triangles {
  std::vector<Vec2> nodes_um;
  /// Corners (turning from +x towards +y), then the nodes on the sides 0–1, 1–2, 2–0.
  std::vector<std::array<int, 6>> nodes;
  /// A side that lies on a curve, in the direction of the curve.
  struct Side {
    std::array<int, 3> nodes;  ///< begin, end, between
    int curve = 0;
    double s_um = 0;  ///< of the node between
  };
  std::vector<Side> sides;
  int n_corners = 0;  ///< the nodes that are corners come first
};

struct TriangleSize {
  double at_curves_um = 1;
  double largest_um = 10;
  double growth = 0.25;          ///< of a triangle's size by distance
  double most_turn_rad = 0.35;   ///< of a side along its curve: a parabola is then 1e-5 of its length off
  double most_notch_rad = 0.35;  ///< the same where the sheet is notched: tensions are concentrated there
};

/// What bounds the triangles.
struct Region {
  std::vector<Curve> rims;   ///< the outer one, then holes in it
  std::vector<Curve> lines;  ///< inside, that sides must follow; rims and lines number the curves
  Cuts cuts = {};            ///< pieces of the rims along the image's border: the sheet goes on beyond
};

/// @throws InvalidData where there would be more than `most` triangles or a curve is too fine to be followed
Triangles triangulated(const Region& region, const TriangleSize& size, std::size_t most);

/// How many there would be, roughly.
double expected_triangles(const Region& region, const TriangleSize& size);

}  // namespace mbtfm::sheet
