#include "network/mesh/parts.h"

#include <algorithm>
#include <numeric>

namespace mbtfm::mesh {
namespace {

/// By vertex, one vertex that stands for its part.
std::vector<int> parts_of(const Network& network) {
  std::vector<int> part(network.vertices_um.size());
  std::iota(part.begin(), part.end(), 0);
  const auto find = [&](int v) {
    while (part[v] != v) v = part[v] = part[part[v]];
    return v;
  };
  for (const Link& link : network.links) part[find(link.vertex_a)] = find(link.vertex_b);
  for (int& p : part) p = find(p);
  return part;
}

}  // namespace

int count_parts(const Network& network) {
  const std::vector<int> part = parts_of(network);
  int n_parts = 0;
  for (std::size_t v = 0; v < part.size(); ++v) n_parts += part[v] == static_cast<int>(v);
  return n_parts;
}

void keep_vertices(Network& network, const std::vector<char>& is_kept) {
  std::vector<int> number(is_kept.size(), -1);
  int next = 0;
  for (std::size_t v = 0; v < is_kept.size(); ++v) {
    if (!is_kept[v]) continue;
    network.vertices_um[next] = network.vertices_um[v];
    network.adhesion_id[next] = network.adhesion_id[v];
    if (!network.held_by_cut.empty()) network.held_by_cut[next] = network.held_by_cut[v];
    number[v] = next++;
  }
  network.vertices_um.resize(next);
  network.adhesion_id.resize(next);
  if (!network.held_by_cut.empty()) network.held_by_cut.resize(next);
  std::erase_if(network.links, [&](const Link& link) { return !is_kept[link.vertex_a]; });
  for (Link& link : network.links) {
    link.vertex_a = number[link.vertex_a];
    link.vertex_b = number[link.vertex_b];
  }
}

int leave_out_loose_parts(Network& network) {
  const std::vector<int> part = parts_of(network);
  std::vector<char> is_held(part.size(), 0), is_kept(part.size(), 0);
  for (std::size_t v = 0; v < part.size(); ++v)
    if (network.adhesion_id[v] != 0) is_held[part[v]] = 1;
  for (const Link& link : network.links)
    if (link.fibre_id != 0) is_held[part[link.vertex_a]] = 1;
  if (std::ranges::find(is_held, 1) == is_held.end()) return 0;  // a cell without adhesions is another error's
  int n_loose = 0;
  for (std::size_t v = 0; v < part.size(); ++v) {
    is_kept[v] = is_held[part[v]];
    if (part[v] == static_cast<int>(v) && !is_held[v]) ++n_loose;
  }
  if (n_loose > 0) keep_vertices(network, is_kept);
  return n_loose;
}

}  // namespace mbtfm::mesh
