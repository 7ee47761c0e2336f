/// Chains of points made planar: no two vertices closer than a tolerance, no vertex that close beside a segment, and
/// segments that cross share a vertex.
#pragma once

#include <vector>

#include "pipeline/contract/types.h"

namespace mbtfm::network {

/// A fibre (or a piece of one), or the outline where fibre_id is 0.
struct Chain {
  int fibre_id = 0;
  bool is_closed = false;
  std::vector<int> vertices;
};

struct PlanarGraph {
  std::vector<Vec2> points_um;
  std::vector<int> rank;  ///< where two vertices merge the one of higher rank keeps its place; rank kHeld never merge
  std::vector<Chain> chains;

  int add_vertex(Vec2 point_um, int vertex_rank) {
    points_um.push_back(point_um);
    rank.push_back(vertex_rank);
    return static_cast<int>(points_um.size()) - 1;
  }
};

inline constexpr int kHeld = 3;  ///< an adhesion's vertex
inline constexpr int kFibreEnd = 2;
inline constexpr int kFibrePoint = 1;
inline constexpr int kOutlinePoint = 0;

/// Merge, split and cross until nothing is left to do, at most `kMaxRounds` times: moves a line by the tolerance at
/// most in each. Vertices that are no longer on a chain stay in the list.
/// @return whether nothing was left to do
bool make_planar(PlanarGraph& graph, double tolerance_um);

/// Split the segments of fibres into pieces of about the edge length.
void subdivide_fibres(PlanarGraph& graph, double edge_um);

}  // namespace mbtfm::network
