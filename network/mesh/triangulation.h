/// Constrained Delaunay triangulation (CGAL) of the inside of the cell.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "network/mesh/frame.h"

namespace mbtfm::mesh {

struct Triangulation {
  struct Edge {
    int vertex_a = 0;
    int vertex_b = 0;
    std::array<int, 2> apexes = {-1, -1};  ///< the vertices across from it; -1 where the cell ends
    bool is_of_frame = false;
  };
  std::vector<std::array<int, 3>> triangles;  ///< inside the outline
  std::vector<Edge> edges;                    ///< of these triangles
};

/// Triangulate the inside of the outline so that each segment of the frame is an edge. The frame's vertices are the
/// first of `points_um`.
/// @return nothing where segments cross
std::optional<Triangulation> triangulate(const std::vector<Vec2>& points_um, const std::vector<FrameSegment>& segments);

/// 2 · inradius / circumradius: 1 for an equilateral triangle, 0 for a flat one.
double quality(Vec2 a, Vec2 b, Vec2 c);

}  // namespace mbtfm::mesh
