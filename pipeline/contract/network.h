/// A network of cables over a cell.
#pragma once

#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// A cable between two vertices of a network.
struct Link {
  int vertex_a = 0;
  int vertex_b = 0;
  int fibre_id = 0;  ///< 0: the actin network
  double rest_length_um = 0;
  double share = 1;  ///< multiplies its group's tension and its stiffness: the width of material this cable represents
};

/// How a cable carries its force in equilibrium: slack with its tension alone, taut with more, being longer than at
/// rest, and collapsed to a point with less, in whatever direction its ends are pressed together.
enum class CableState { slack, taut, collapsed };

struct Network {
  std::vector<Vec2> vertices_um;
  std::vector<int> adhesion_id;  ///< by vertex; the substrate holds it where it is not 0
  std::vector<Link> links;
  std::vector<bool> held_by_cut{};  ///< by vertex: the part of the cell that the image does not show holds it; empty:
                                    ///< none. No adhesion holds it, too
};
/// By an adhesion or by the cut.
inline bool is_held(const Network& network, std::size_t vertex) {
  return network.adhesion_id[vertex] != 0 || (!network.held_by_cut.empty() && network.held_by_cut[vertex]);
}

/// A network in equilibrium: its vertices are where the cables have drawn them; force_nN is carried by each link.
struct ContractedNetwork {
  Network network;
  std::vector<double> link_force_nN;
};

/// State what must hold of a value. @throws InvalidData naming the element and the finding.
void check(const Network& network);

}  // namespace mbtfm
