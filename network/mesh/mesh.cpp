#include "network/mesh/mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "network/mesh/frame.h"
#include "network/mesh/links.h"
#include "network/mesh/relax.h"
#include "pipeline/numerics/neighbour_bins.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::mesh {
namespace {

/// By vertex, one vertex that represents its part: what hangs together by links.
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

int count_parts(const Network& network) {
  const std::vector<int> part = parts_of(network);
  int n_parts = 0;
  for (std::size_t v = 0; v < part.size(); ++v) n_parts += part[v] == static_cast<int>(v);
  return n_parts;
}

/// Leave out the other vertices, and links from them; those that stay keep their order.
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

/// Leave out the parts that hang together by links of their own only and hold neither an adhesion nor a link of a
/// fibre, as the tip of a cell beyond a neck thinner than the mesh resolves: they would contract to a point and pull on
/// nothing. @return how many
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

/// Each vertex belongs to the adhesion whose ellipse it lies in, or on whose rim; the nearest where several overlap.
void hold_adhesions(const Cell& cell, const Frame& frame, Network& network) {
  std::map<int, Vec2> position_um;
  for (const Adhesion& a : cell.adhesions) position_um[a.adhesion_id] = a.position_um;
  std::vector<double> nearest(network.vertices_um.size(), std::numeric_limits<double>::infinity());
  numerics::Grid grid(network.vertices_um, frame.size.edge_um());
  for (int v = 0; v < static_cast<int>(nearest.size()); ++v) {
    grid.add(v, network.vertices_um[v], network.vertices_um[v]);
    if (network.adhesion_id[v] != 0) {
      nearest[v] = -1;  // an adhesion's own
    } else if (v < static_cast<int>(frame.rim_adhesion_id.size()) && frame.rim_adhesion_id[v] != 0) {
      network.adhesion_id[v] = frame.rim_adhesion_id[v];
      nearest[v] = norm(network.vertices_um[v] - position_um[network.adhesion_id[v]]);
    }
  }
  for (const Adhesion& adhesion : cell.adhesions) {
    const Vec2 at = adhesion.position_um;
    grid.for_each_near(at, at, 0.5 * adhesion.major_axis_um, [&](int v) {
      const double distance = norm(network.vertices_um[v] - at);
      if (distance >= nearest[v] || !covers(adhesion, network.vertices_um[v])) return;
      nearest[v] = distance;
      network.adhesion_id[v] = adhesion.adhesion_id;
    });
  }
}

/// The cut holds the vertices on it that no adhesion holds. The mesh keeps those on the outline that lie within a
/// quarter of an edge of it (frame.cpp), so a vertex as near as that to a cut lies on it.
void hold_cut(const Cell& cell, const Frame& frame, Network& network) {
  constexpr double kOnCut = 0.25;
  if (cuts_of(cell).empty()) return;
  for (std::size_t v = 0; v < network.vertices_um.size(); ++v) {
    const Vec2 at = network.vertices_um[v];
    network.held_by_cut.push_back(network.adhesion_id[v] == 0 &&
                                  distance_to_cut_um(cell, at) < kOnCut * frame.size.at(at));
  }
}

/// Leave out vertices that no link joins, as the tip of a whisker of the outline. An adhesion that would lose its last
/// is joined to the nearest vertex that stays.
void leave_out_loose_vertices(Network& network) {
  const std::size_t n = network.vertices_um.size();
  std::vector<char> is_joined(n, 0);
  for (const Link& link : network.links) is_joined[link.vertex_a] = is_joined[link.vertex_b] = 1;
  std::set<int> held;
  for (std::size_t v = 0; v < n; ++v)
    if (is_joined[v]) held.insert(network.adhesion_id[v]);
  for (std::size_t v = 0; v < n; ++v) {
    if (is_joined[v] || network.adhesion_id[v] == 0 || !held.insert(network.adhesion_id[v]).second) continue;
    std::size_t nearest = n;
    for (std::size_t w = 0; w < n; ++w) {
      if (w == v || !is_joined[w]) continue;
      const double distance = norm(network.vertices_um[w] - network.vertices_um[v]);
      if (nearest == n || distance < norm(network.vertices_um[nearest] - network.vertices_um[v])) nearest = w;
    }
    if (nearest == n) continue;
    Link link{.vertex_a = static_cast<int>(std::min(v, nearest)), .vertex_b = static_cast<int>(std::max(v, nearest))};
    link.rest_length_um = norm(network.vertices_um[nearest] - network.vertices_um[v]);
    network.links.push_back(link);
    is_joined[v] = 1;
  }
  keep_vertices(network, is_joined);
}

void measure_quality(const RelaxedMesh& mesh, int n_of_frame, GeneratedNetwork& result) {
  result.worst_quality = result.worst_free_quality = 1;
  double sum_of_free = 0;
  int n_free = 0;
  for (const auto& t : mesh.triangulation.triangles) {
    const double q = quality(mesh.points_um[t[0]], mesh.points_um[t[1]], mesh.points_um[t[2]]);
    result.mean_quality += q / static_cast<double>(mesh.triangulation.triangles.size());
    result.worst_quality = std::min(result.worst_quality, q);
    result.n_needles += q < 0.1;
    if (t[0] >= n_of_frame) {  // the smallest of the three
      result.worst_free_quality = std::min(result.worst_free_quality, q);
      sum_of_free += q;
      ++n_free;
    }
    result.area_um2 +=
        0.5 * std::abs(cross(mesh.points_um[t[1]] - mesh.points_um[t[0]], mesh.points_um[t[2]] - mesh.points_um[t[0]]));
  }
  int n_even = 0;
  for (const auto& e : mesh.triangulation.edges) {
    result.mean_edge_um += norm(mesh.points_um[e.vertex_b] - mesh.points_um[e.vertex_a]) /
                           static_cast<double>(mesh.triangulation.edges.size());
    const double wanted = 0.5 * (mesh.size_um[e.vertex_a] + mesh.size_um[e.vertex_b]);
    const double relative = norm(mesh.points_um[e.vertex_b] - mesh.points_um[e.vertex_a]) / wanted;
    n_even += relative >= 0.6 && relative <= 1.5;
  }
  result.even_share = n_even / static_cast<double>(mesh.triangulation.edges.size());
  result.mean_free_quality = n_free > 0 ? sum_of_free / n_free : 1;
  result.n_triangles = static_cast<int>(mesh.triangulation.triangles.size());
}

/// Before any vertex is made: those that an even mesh of the cell takes are the fewest.
void expect_room_for_even_mesh(const Cell& cell, const NetworkParameters& parameters) {
  double area_um2 = std::abs(signed_area_um2(cell.outline_um));
  for (const Polygon& hole : cell.holes_um) area_um2 -= std::abs(signed_area_um2(hole));
  expect_room_for_vertices(area_um2 / area_of_vertex_um2(parameters.edge_length_um));
}

}  // namespace

void declare(stage::ParameterList& list, NetworkParameters& parameters) {
  list.table("network");
  list.add("edge_length_um", parameters.edge_length_um, Range::mesh_um());
  list.add("seed", parameters.seed);
  list.add("link_weights", parameters.link_weights);
  list.add("link_reach", parameters.link_reach);
  list.add("adhesion_anchor", parameters.adhesion_anchor);
  list.add("rim_points", parameters.rim_points, Range::between(3, 1000));
}

GeneratedNetwork generate_network(const Cell& cell, const NetworkParameters& parameters) {
  check(cell);
  expect_room_for_even_mesh(cell, parameters);
  Random random(parameters.seed);
  const Boundary boundary(cell, parameters.edge_length_um);
  const Frame frame = build_frame(cell, boundary, parameters, random);
  const RelaxedMesh mesh = fill_and_relax(frame, boundary, random);

  GeneratedNetwork result;
  result.report = mesh.report;
  result.clipped_fibre_ids = frame.clipped_fibre_ids;
  result.snapped_adhesion_ids = frame.snapped_adhesion_ids;
  result.separated_adhesion_ids = frame.separated_adhesion_ids;
  result.n_shared_segments = frame.n_shared_segments;
  result.n_filled_holes = boundary.n_filled_holes();
  result.network.vertices_um = mesh.points_um;
  result.network.adhesion_id = frame.adhesion_id;
  result.network.adhesion_id.resize(mesh.points_um.size(), 0);
  if (parameters.adhesion_anchor != AdhesionAnchor::centre) hold_adhesions(cell, frame, result.network);
  hold_cut(cell, frame, result.network);
  result.network.links = links_of(frame, mesh, parameters);
  leave_out_loose_vertices(result.network);
  result.n_loose_parts = leave_out_loose_parts(result.network);
  std::sort(result.network.links.begin(), result.network.links.end(), [](const Link& a, const Link& b) {
    return std::tie(a.vertex_a, a.vertex_b, a.fibre_id) < std::tie(b.vertex_a, b.vertex_b, b.fibre_id);
  });
  result.n_parts = count_parts(result.network);
  measure_quality(mesh, static_cast<int>(frame.points_um.size()), result);
  check(result.network);
  return result;
}

}  // namespace mbtfm::mesh
