/// The inside of a frame filled with vertices that push each other to even distances (distmesh).
#pragma once

#include <vector>

#include "network/frame.h"
#include "network/triangulation.h"
#include "pipeline/contract/report.h"

namespace mbtfm::network {

struct RelaxedMesh {
  std::vector<Vec2> points_um;  ///< the frame's first
  Triangulation triangulation;
  Report report;
};

/// Fill the frame with vertices and relax them as in distmesh: edges are springs that only push, of rest length
/// 1.2 times the wanted one; the frame's vertices stay, but those that slide on the outline.
/// Source: Persson & Strang, SIAM Review 46:329 (2004); constrained edges and walls are ours.
/// @throws InvalidData where lines of the frame cross
RelaxedMesh fill_and_relax(const Frame& frame, const OutlineCurve& outline, double edge_um, Random& random);

}  // namespace mbtfm::network
