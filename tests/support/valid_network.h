/// What must hold of every generated network.
#pragma once

#include "network/mesh/mesh.h"
#include "tests/support/test.h"

namespace mbtfm::test {

inline double length_of_fibre_um(const Network& network, int fibre_id) {
  double length = 0;
  for (const Link& link : network.links) length += link.fibre_id == fibre_id ? link.rest_length_um : 0.0;
  return length;
}

/// Its links form one path, or one for each piece that clipping left: no vertex but ends and crossings of the fibre
/// with itself has another number of its links than two.
inline int n_ends_of_fibre(const Network& network, int fibre_id) {
  std::map<int, int> degree;
  for (const Link& link : network.links) {
    if (link.fibre_id != fibre_id) continue;
    ++degree[link.vertex_a];
    ++degree[link.vertex_b];
  }
  return static_cast<int>(std::count_if(degree.begin(), degree.end(), [](auto& d) { return d.second == 1; }));
}

/// The finest wanted edge length, but for lines of the frame that are close together.
inline double finest_edge_um(const Cell& cell, const mesh::NetworkParameters& parameters) {
  double finest = parameters.edge_length_um;
  for (const Adhesion& a : cell.adhesions) {
    Polygon rim = ellipse_corners(a, 64);
    rim.push_back(rim.front());
    if (parameters.adhesion_anchor == mesh::AdhesionAnchor::rim)
      finest = std::min(finest, length_um(rim) / parameters.rim_points);
  }
  return finest;
}

/// @param edge_length_um  the finest wanted
inline void expect_valid(const mesh::GeneratedNetwork& generated, const Cell& cell, double edge_length_um) {
  const Network& net = generated.network;
  ASSERT_NO_THROW(check(net));
  EXPECT_EQ(generated.n_parts, 1);
  std::set<std::tuple<int, int, int>> seen;
  std::vector<int> degree(net.vertices_um.size(), 0);
  for (const Link& link : net.links) {
    // vertices of the frame within a tenth of an edge merge (adhesions are kept a fifth apart), and free ones give way
    // at half the wanted length, which is 0.4 edges at least
    EXPECT_GT(link.rest_length_um, 0.1 * (1 - 1e-9) * edge_length_um);
    const auto [low, high] = std::minmax(link.vertex_a, link.vertex_b);
    EXPECT_TRUE(seen.insert({low, high, link.fibre_id}).second) << "link " << low << "-" << high << " twice";
    ++degree[low];
    ++degree[high];
  }
  for (std::size_t v = 0; v < degree.size(); ++v) EXPECT_GE(degree[v], 2) << "vertex " << v;
  std::set<int> holding(net.adhesion_id.begin(), net.adhesion_id.end());
  for (const Adhesion& a : cell.adhesions) EXPECT_TRUE(holding.contains(a.adhesion_id)) << "adhesion " << a.adhesion_id;
  for (const Fibre& f : cell.fibres) EXPECT_GT(length_of_fibre_um(net, f.fibre_id), 0) << "fibre " << f.fibre_id;
}

}  // namespace mbtfm::test
