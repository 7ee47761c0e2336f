/// A cable network over a segmented cell: a triangulation that contains its fibres, relaxed to even edge lengths.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/parameters.h"
#include "pipeline/contract/report.h"
#include "pipeline/contract/types.h"

namespace mbtfm::network {

struct NetworkParameters {
  double edge_length_um = 1.5;  ///< mean cable length: about the spacing of the bundles one can resolve
  std::uint64_t seed = 1;       ///< of the first placement of the vertices
};
void declare(ParameterList& list, NetworkParameters& parameters);

struct GeneratedNetwork {
  Network network;
  Report report;
  double mean_quality = 0;  ///< of the triangles: 2 · inradius / circumradius
  double worst_quality = 0;
  std::vector<int> clipped_fibre_ids;     ///< cut at the outline
  std::vector<int> snapped_adhesion_ids;  ///< just outside the outline, drawn in
};

/// Span a network. Fibre polylines are chains of links of their fibre_id; each adhesion holds the vertices inside its
/// ellipse, at least one.
/// @throws InvalidData where an adhesion or a fibre lies outside the cell
GeneratedNetwork generate_network(const Cell& cell, const NetworkParameters& parameters);

}  // namespace mbtfm::network
