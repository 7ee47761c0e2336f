/// Chains of points made planar: no two vertices closer than a tolerance, no vertex that close beside a segment, and
/// segments that cross share a vertex.
#pragma once

#include <vector>

#include "network/mesh/size_field.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::mesh {

/// A fibre (or a piece of one), the rim of an adhesion (or a piece of it), or else a ring of the outline.
struct Chain {
  int fibre_id = 0;
  int adhesion_id = 0;
  bool is_closed = false;
  std::vector<int> vertices{};
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

inline constexpr int kHeld = 4;  ///< an adhesion's centre
inline constexpr int kFibreEnd = 3;
inline constexpr int kRimPoint = 2;
inline constexpr int kFibrePoint = 1;
inline constexpr int kOutlinePoint = 0;

/// Merge, split and cross until nothing is left to do, at most `kMaxRounds` times: moves a line by the tolerance at
/// most in each. Vertices that are no longer on a chain stay in the list.
/// @param tolerance  in wanted edge lengths
/// @return whether nothing was left to do
bool make_planar(PlanarGraph& graph, const SizeField& size, double tolerance);

/// Divide fibres and rims into pieces of about the wanted length, evenly between the vertices that must stay: ends,
/// those held, those where lines meet, and those where a fibre turns by more than 25° (a gentler bend loses less than
/// 0.06 edges).
void divide_evenly(PlanarGraph& graph, const SizeField& size);

}  // namespace mbtfm::mesh
