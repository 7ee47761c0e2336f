/// The inside of a frame filled with vertices that push each other to even distances (distmesh).
#pragma once

#include <string>
#include <vector>

#include "network/frame.h"
#include "network/triangulation.h"
#include "pipeline/contract/report.h"

namespace mbtfm::network {

struct RelaxedMesh {
  std::vector<Vec2> points_um;  ///< the frame's first
  Triangulation triangulation;
  std::vector<double> size_um;  ///< wanted edge length at each
  Report report;
};

RelaxedMesh fill_and_relax(Frame frame, const Boundary& boundary, const std::string& seeds, Random& random);

}  // namespace mbtfm::network
