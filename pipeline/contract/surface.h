/// The surface of a gel that is not flat.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// Heights z = s(x, y), z into the gel, on a lattice parallel to x and y.
struct HeightMap {
  Vec2 origin_um;   ///< the first vertex
  Vec2 spacing_um;  ///< between neighbours, positive
  int n_x = 0, n_y = 0;
  std::vector<double> z_um = {};      ///< by vertex, x fastest
  std::vector<double> sigma_um = {};  ///< standard error of each; empty: exact

  Vec2 place_um(double column, double row) const { return origin_um + Vec2{column * spacing_um.x, row * spacing_um.y}; }
  Vec2 vertex_um(std::size_t k) const {
    const auto n = static_cast<std::size_t>(n_x);
    return place_um(static_cast<double>(k % n), static_cast<double>(k / n));
  }
  Vec2 high_um() const { return place_um(n_x - 1, n_y - 1); }
};

/// @throws InvalidData where the lattice has fewer than 4 x 4 vertices, sizes differ or a number is not finite
void check(const HeightMap& map);

/// A surface in space made of triangles.
struct TriangleMesh {
  std::vector<Vec3> points_um;
  std::vector<std::array<int, 3>> triangles;  ///< points of the corners
};

/// @throws InvalidData where a number is not finite or beyond a metre, or a corner no point
void check(const TriangleMesh& mesh);

}  // namespace mbtfm
