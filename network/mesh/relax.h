/// The inside of a frame filled with vertices, and these brought to even distances.
#pragma once

#include <vector>

#include "network/mesh/frame.h"
#include "network/mesh/triangulation.h"
#include "pipeline/contract/report.h"

namespace mbtfm::mesh {

struct RelaxedMesh {
  std::vector<Vec2> points_um;  ///< the frame's first
  Triangulation triangulation;
  std::vector<double> size_um;  ///< wanted edge length at each
  Report report;
};

/// Fill the frame with vertices and relax them: in turns, each vertex goes to the centroid of its triangles, weighted
/// by area over h², and edges flip to a constrained Delaunay triangulation. This lowers an energy in each half step and
/// comes to rest within tens of sweeps, where distmesh's springs wander on. The frame's vertices stay, but those that
/// slide on the boundary. Where the wanted length h asks for more or fewer vertices, they are put in or taken out.
/// Sources: Chen & Holst, Comput. Methods Appl. Mech. Eng. 200:967 (2011), centroidal patch triangulation; Persson &
/// Strang, SIAM Review 46:329 (2004), for h and the sliding. Constrained edges and walls are ours.
/// @throws InvalidData where lines of the frame cross, OutOfMemory
RelaxedMesh fill_and_relax(Frame frame, const Boundary& boundary, Random& random);

}  // namespace mbtfm::mesh
