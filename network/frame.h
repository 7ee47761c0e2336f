/// What the mesh must contain: adhesions, fibres and outline as vertices and segments.
#pragma once

#include <vector>

#include "network/outline.h"
#include "network/random.h"
#include "pipeline/contract/types.h"

namespace mbtfm::network {

struct FrameSegment {
  int vertex_a = 0;
  int vertex_b = 0;
  std::vector<int> fibre_ids;  ///< rising; several where fibres share the segment
  int outline_count = 0;       ///< how often the outline runs along it: odd where it bounds the cell
};

struct Frame {
  std::vector<Vec2> points_um;
  std::vector<int> adhesion_id;      ///< 0: none
  std::vector<double> outline_s_um;  ///< arc length on the outline of a vertex that may slide there; else NaN
  std::vector<FrameSegment> segments;
  std::vector<int> clipped_fibre_ids;
  std::vector<int> snapped_adhesion_ids;
  std::vector<int> separated_adhesion_ids;  ///< moved apart from one at the same place
  int n_shared_segments = 0;
  bool is_planar = true;

  bool slides(int vertex) const { return outline_s_um[vertex] == outline_s_um[vertex]; }
};

/// @throws InvalidData where an adhesion lies further than an edge length outside the outline, or all of a fibre does
Frame build_frame(const Cell& cell, const OutlineCurve& outline, double edge_um, Random& random);

/// The adhesion's ellipse contains the point.
bool covers(const Adhesion& adhesion, Vec2 point_um);

}  // namespace mbtfm::network
