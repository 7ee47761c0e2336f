/// A cable network over a segmented cell: a triangulation that contains its fibres, relaxed to even edge lengths.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/report.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::mesh {

enum class LinkWeights {
  equal,  ///< as in the thesis
  width   ///< of the material that a link represents
};
constexpr auto words(LinkWeights) { return std::array{"equal", "width"}; }

enum class LinkReach {
  neighbours,        ///< as in the thesis
  second_neighbours  ///< halves the spread between meshes
};
constexpr auto words(LinkReach) { return std::array{"neighbours", "second-neighbours"}; }

enum class AdhesionAnchor { rim, ellipse, centre };
constexpr auto words(AdhesionAnchor) { return std::array{"rim", "ellipse", "centre"}; }

struct NetworkParameters {
  double edge_length_um = 1.5;  ///< mean cable length: about the spacing of the bundles one can resolve
  std::uint64_t seed = 1;       ///< of the first placement of the vertices
  LinkWeights link_weights = LinkWeights::width;
  LinkReach link_reach = LinkReach::second_neighbours;
  AdhesionAnchor adhesion_anchor = AdhesionAnchor::ellipse;
  int rim_points = 8;  ///< round an adhesion, at least: an octagon shows which way it is long
};
void declare(stage::ParameterList& list, NetworkParameters& parameters);

struct GeneratedNetwork {
  Network network;
  Report report;
  double mean_edge_um = 0;  ///< of the triangulation
  double mean_quality = 0;  ///< of the triangles: 2 · inradius / circumradius
  double worst_quality = 0;
  double mean_free_quality = 0;   ///< of those away from fibres, adhesions and outline, whose shape nothing forces
  double worst_free_quality = 0;  ///< of the same; 1 where there are none
  double even_share = 0;          ///< of the edges, that are 0.6 to 1.5 times as long as wanted there
  int n_needles = 0;              ///< triangles of quality below 0.1, which only lines that close can force
  int n_triangles = 0;
  double area_um2 = 0;  ///< of the triangles
  int n_parts = 1;  ///< that no link joins: more than one where a neck is thinner than a tenth of an edge, or holes cut
                    ///< the cell up
  int n_loose_parts = 0;                    ///< that no adhesion holds: left out
  int n_shared_segments = 0;                ///< where several fibres run along one edge, each with a link of its own
  int n_filled_holes = 0;                   ///< smaller than a triangle
  std::vector<int> clipped_fibre_ids;       ///< cut at the outline, or at a hole they end in
  std::vector<int> snapped_adhesion_ids;    ///< outside the cell by up to an edge length: the mesh reaches out to them
  std::vector<int> separated_adhesion_ids;  ///< moved apart, being at the same place
};

/// Span a network. Fibre polylines are chains of links of their fibre_id; each adhesion holds the vertices inside its
/// ellipse and on its rim, at least the one at its centre; the cut of a cell that its image cuts holds the vertices on
/// it. A fibre that is said to end on an adhesion ends at its centre. Holes are left out, but fibres span them. Lines
/// closer than a tenth of the wanted edge length run together; the outline passes through what lies within a quarter of
/// it. docs/theory/network.md, "How the mesh is made".
/// @throws InvalidData where an adhesion lies more than an edge length outside the cell, or all of a fibre does
GeneratedNetwork generate_network(const Cell& cell, const NetworkParameters& parameters);

}  // namespace mbtfm::mesh
