/// The surface of a gel that is not flat.
#pragma once

#include <array>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// Heights z = s(x, y), z into the gel, on a lattice parallel to x and y.
struct HeightMap {
  Vec2 origin_um;   ///< the first vertex
  Vec2 spacing_um;  ///< between neighbours, positive
  int n_x = 0, n_y = 0;
  std::vector<double> z_um;      ///< by vertex, x fastest
  std::vector<double> sigma_um;  ///< standard error of each; empty: exact

  Vec2 high_um() const { return origin_um + Vec2{(n_x - 1) * spacing_um.x, (n_y - 1) * spacing_um.y}; }
};

/// @throws InvalidData where the lattice has fewer than 4 x 4 vertices, sizes differ or a number is not finite
void check(const HeightMap& map);

/// A surface in space made of triangles.
struct TriangleMesh {
  std::vector<Vec3> points_um;
  std::vector<std::array<int, 3>> triangles;  ///< points of the corners
};

/// @throws InvalidData where a number is not finite, or a corner no point
void check(const TriangleMesh& mesh);

}  // namespace mbtfm
