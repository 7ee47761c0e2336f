/// A cable network over a segmented cell: a triangulation that contains its fibres, relaxed to even edge lengths.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/contract/parameters.h"
#include "pipeline/contract/report.h"
#include "pipeline/contract/types.h"

namespace mbtfm::network {

struct NetworkParameters {
  double edge_length_um = 1.5;              ///< mean cable length: about the spacing of the bundles one can resolve
  std::uint64_t seed = 1;                   ///< of the first placement of the vertices
  std::string link_weights = "width";       ///< equal (thesis) | width
  std::string adhesion_anchor = "ellipse";  ///< ellipse | centre
};
void declare(ParameterList& list, NetworkParameters& parameters);

struct GeneratedNetwork {
  Network network;
  Report report;
  double mean_quality = 0;  ///< of the triangles: 2 · inradius / circumradius
  double worst_quality = 0;
  int n_triangles = 0;
  double area_um2 = 0;        ///< of the triangles
  int n_parts = 1;            ///< that no link joins: more than one where a neck is thinner than a tenth of an edge
  int n_shared_segments = 0;  ///< where several fibres run along one edge, each with a link of its own
  std::vector<int> clipped_fibre_ids;     ///< cut at the outline
  std::vector<int> snapped_adhesion_ids;  ///< outside the outline by up to an edge length: the mesh reaches out to them
  std::vector<int> separated_adhesion_ids;  ///< moved apart, being at the same place
};

/// Span a network. Fibre polylines are chains of links of their fibre_id; each adhesion holds the vertices inside its
/// ellipse, at least the one at its centre. A fibre that is said to end on an adhesion ends at its centre.
/// Lines closer than a tenth of an edge length run together; the outline passes through what lies within a quarter
/// of an edge length of it.
/// @throws InvalidData where an adhesion lies more than an edge length outside the cell, or all of a fibre does
GeneratedNetwork generate_network(const Cell& cell, const NetworkParameters& parameters);

}  // namespace mbtfm::network
