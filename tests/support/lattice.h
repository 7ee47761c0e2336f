/// Regular triangular cable lattices with straight fibres and random adhesions: networks of any size from a seed.
#pragma once

#include "pipeline/contract/geometry.h"
#include "pipeline/contract/network.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct Lattice {
  int columns = 12;
  int rows = 12;
  double edge_um = 1.5;
  int n_fibres = 4;
  unsigned seed = 1;
};

/// Four adhesions at the corners and about sqrt(columns · rows) more along the boundary, one vertex each. Fibres run
/// along lattice lines; a later one may take links of an earlier one.
inline Network lattice(const Lattice& p) {
  Network network;
  std::mt19937 random(p.seed);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const auto vertex = [&](int i, int j) { return j * p.columns + i; };
  for (int j = 0; j < p.rows; ++j)
    for (int i = 0; i < p.columns; ++i)
      network.vertices_um.push_back({p.edge_um * (i + 0.5 * (j % 2)), p.edge_um * std::sqrt(0.75) * j});
  network.adhesion_id.assign(network.vertices_um.size(), 0);

  const auto connect = [&](int a, int b) {
    network.links.push_back({.vertex_a = a,
                             .vertex_b = b,
                             .fibre_id = 0,
                             .rest_length_um = norm(network.vertices_um[b] - network.vertices_um[a])});
  };
  for (int j = 0; j < p.rows; ++j)
    for (int i = 0; i < p.columns; ++i) {
      const int slanted = j % 2 ? i + 1 : i - 1;
      if (i + 1 < p.columns) connect(vertex(i, j), vertex(i + 1, j));
      if (j + 1 < p.rows) connect(vertex(i, j), vertex(i, j + 1));
      if (j + 1 < p.rows && slanted >= 0 && slanted < p.columns) connect(vertex(i, j), vertex(slanted, j + 1));
    }
  for (int fibre = 1; fibre <= p.n_fibres; ++fibre) {
    int i = below(p.columns), j = below(p.rows);
    const bool is_level = random() % 2 == 0;
    for (int length = 4 + below(p.columns / 2); length > 0; --length) {
      const int from = vertex(i, j);
      i += is_level || j % 2 ? 1 : 0;
      j += is_level ? 0 : 1;
      if (i >= p.columns || j >= p.rows) break;
      for (Link& link : network.links)
        if (std::pair(link.vertex_a, link.vertex_b) == std::pair(from, vertex(i, j))) link.fibre_id = fibre;
    }
  }
  int n_adhesions = 0;
  const auto hold = [&](int v) {
    if (network.adhesion_id[v] == 0) network.adhesion_id[v] = ++n_adhesions;
  };
  for (const int j : {0, p.rows - 1})
    for (const int i : {0, p.columns - 1}) hold(vertex(i, j));
  for (int k = static_cast<int>(std::sqrt(p.columns * p.rows)); k > 0; --k) {
    const int i = below(p.columns), j = below(p.rows), side = below(4);
    hold(side < 2 ? vertex(i, side == 0 ? 0 : p.rows - 1) : vertex(side == 2 ? 0 : p.columns - 1, j));
  }
  return network;
}

/// 0.06 nN in the network, up to 10 nN in a fibre: the range of the thesis' simulated test.
inline std::vector<double> random_tensions_nN(std::size_t n_groups, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<double> tensions{0.06};
  while (tensions.size() < n_groups) tensions.push_back(10 * (random() / 4294967296.0));
  return tensions;
}

}  // namespace mbtfm::test
