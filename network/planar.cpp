#include "network/planar.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "network/grid.h"

namespace mbtfm::network {
namespace {

constexpr int kMaxRounds = 12;

struct Segment {
  int chain = 0;
  int place = 0;  ///< of its first vertex in the chain
  int a = 0;
  int b = 0;
};

/// A vertex to be put into a segment, `along` of its length from its start.
struct Cut {
  int chain = 0;
  int place = 0;
  double along = 0;
  int vertex = 0;
};

std::vector<Segment> segments_of(const PlanarGraph& graph) {
  std::vector<Segment> segments;
  for (int c = 0; c < static_cast<int>(graph.chains.size()); ++c) {
    const Chain& chain = graph.chains[c];
    const int n = static_cast<int>(chain.vertices.size());
    for (int i = 0; i < (chain.is_closed ? n : n - 1); ++i) {
      segments.push_back({c, i, chain.vertices[i], chain.vertices[(i + 1) % n]});
    }
  }
  return segments;
}

std::vector<char> used_vertices(const PlanarGraph& graph) {
  std::vector<char> is_used(graph.points_um.size(), 0);
  for (const Chain& chain : graph.chains) {
    for (const int v : chain.vertices) is_used[v] = 1;
  }
  for (std::size_t v = 0; v < is_used.size(); ++v) is_used[v] |= graph.rank[v] == kHeld;
  return is_used;
}

/// Replace every vertex by the one it merged into; no chain names a vertex twice in a row.
void rename(PlanarGraph& graph, const std::vector<int>& name) {
  for (Chain& chain : graph.chains) {
    for (int& v : chain.vertices) v = name[v];
    chain.vertices.erase(std::unique(chain.vertices.begin(), chain.vertices.end()), chain.vertices.end());
    while (chain.is_closed && chain.vertices.size() > 1 && chain.vertices.front() == chain.vertices.back()) {
      chain.vertices.pop_back();
    }
  }
  std::erase_if(graph.chains, [](const Chain& chain) { return chain.vertices.size() < 2; });
}

bool merge_close(PlanarGraph& graph, double tolerance) {
  const std::vector<char> is_used = used_vertices(graph);
  // by falling rank, then by index, so that the one that stays is found first
  std::vector<int> order(graph.points_um.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return graph.rank[a] > graph.rank[b]; });
  std::vector<int> name(graph.points_um.size());
  std::iota(name.begin(), name.end(), 0);
  Grid kept(graph.points_um, tolerance);
  bool has_changed = false;
  for (const int v : order) {
    if (!is_used[v]) continue;
    int into = v;
    double nearest = tolerance;
    if (graph.rank[v] != kHeld) {
      kept.for_each_near(graph.points_um[v], graph.points_um[v], tolerance, [&](int other) {
        const double distance = norm(graph.points_um[other] - graph.points_um[v]);
        if (distance < nearest) {
          nearest = distance;
          into = other;
        }
      });
    }
    name[v] = into;
    if (into == v) kept.add(v, graph.points_um[v], graph.points_um[v]);
    has_changed = has_changed || into != v;
  }
  if (has_changed) rename(graph, name);
  return has_changed;
}

/// Put the cuts into their chains.
void apply(PlanarGraph& graph, std::vector<Cut> cuts) {
  std::stable_sort(cuts.begin(), cuts.end(), [](const Cut& a, const Cut& b) {
    return std::tie(a.chain, a.place, a.along) < std::tie(b.chain, b.place, b.along);
  });
  std::vector<std::vector<int>> longer(graph.chains.size());
  std::size_t next = 0;
  for (int c = 0; c < static_cast<int>(graph.chains.size()); ++c) {
    for (int i = 0; i < static_cast<int>(graph.chains[c].vertices.size()); ++i) {
      longer[c].push_back(graph.chains[c].vertices[i]);
      for (; next < cuts.size() && cuts[next].chain == c && cuts[next].place == i; ++next) {
        longer[c].push_back(cuts[next].vertex);
      }
    }
    graph.chains[c].vertices = std::move(longer[c]);
  }
  std::vector<int> same(graph.points_um.size());
  std::iota(same.begin(), same.end(), 0);
  rename(graph, same);
}

double segment_grid_cell(const PlanarGraph& graph, const std::vector<Segment>& segments) {
  double sum = 0;
  for (const Segment& s : segments) sum += norm(graph.points_um[s.b] - graph.points_um[s.a]);
  return sum / static_cast<double>(std::max<std::size_t>(1, segments.size()));
}

bool split_at_close_vertices(PlanarGraph& graph, double tolerance) {
  const std::vector<Segment> segments = segments_of(graph);
  const std::vector<char> is_used = used_vertices(graph);
  Grid vertices(graph.points_um, segment_grid_cell(graph, segments));
  for (int v = 0; v < static_cast<int>(graph.points_um.size()); ++v) {
    if (is_used[v]) vertices.add(v, graph.points_um[v], graph.points_um[v]);
  }
  std::vector<Cut> cuts;
  for (const Segment& s : segments) {
    const Vec2 a = graph.points_um[s.a];
    const Vec2 step = graph.points_um[s.b] - a;
    vertices.for_each_near(a, graph.points_um[s.b], tolerance, [&](int v) {
      if (v == s.a || v == s.b) return;
      const double along = dot(graph.points_um[v] - a, step) / dot(step, step);
      if (along <= 0 || along >= 1) return;
      if (norm(graph.points_um[v] - (a + along * step)) < tolerance) cuts.push_back({s.chain, s.place, along, v});
    });
  }
  if (cuts.empty()) return false;
  apply(graph, std::move(cuts));
  return true;
}

bool cross_segments(PlanarGraph& graph) {
  const std::vector<Segment> segments = segments_of(graph);
  Grid index(graph.points_um, segment_grid_cell(graph, segments));
  std::vector<Cut> cuts;
  for (int k = 0; k < static_cast<int>(segments.size()); ++k) {
    const Segment s = segments[k];
    const Vec2 a = graph.points_um[s.a];
    const Vec2 b = graph.points_um[s.b];
    index.for_each_near(a, b, 0, [&](int other) {
      const Segment t = segments[other];
      if (s.a == t.a || s.a == t.b || s.b == t.a || s.b == t.b) return;
      const Vec2 c = graph.points_um[t.a];
      const Vec2 d = graph.points_um[t.b];
      const double determinant = cross(b - a, d - c);
      if (determinant == 0) return;  // parallel: their ends lie on each other and were put in as vertices
      const double along_s = cross(c - a, d - c) / determinant;
      const double along_t = cross(c - a, b - a) / determinant;
      if (along_s <= 0 || along_s >= 1 || along_t <= 0 || along_t >= 1) return;
      const int rank = std::max(graph.chains[s.chain].fibre_id > 0, graph.chains[t.chain].fibre_id > 0) ? kFibrePoint
                                                                                                        : kOutlinePoint;
      const int v = graph.add_vertex(a + along_s * (b - a), rank);
      cuts.push_back({s.chain, s.place, along_s, v});
      cuts.push_back({t.chain, t.place, along_t, v});
    });
    index.add(k, a, b);
  }
  if (cuts.empty()) return false;
  apply(graph, std::move(cuts));
  return true;
}

}  // namespace

bool make_planar(PlanarGraph& graph, double tolerance_um) {
  for (int round = 0; round < kMaxRounds; ++round) {
    bool has_changed = cross_segments(graph);
    has_changed = merge_close(graph, tolerance_um) || has_changed;
    has_changed = split_at_close_vertices(graph, tolerance_um) || has_changed;
    if (!has_changed) return true;
  }
  return false;
}

void subdivide_fibres(PlanarGraph& graph, double edge_um) {
  std::map<std::pair<int, int>, std::vector<int>> done;  // a segment two fibres share gets the same vertices
  std::vector<Cut> cuts;
  for (const Segment& s : segments_of(graph)) {
    if (graph.chains[s.chain].fibre_id == 0) continue;
    const Vec2 a = graph.points_um[s.a];
    const Vec2 b = graph.points_um[s.b];
    const int pieces = std::max(1, static_cast<int>(std::lround(norm(b - a) / edge_um)));
    const auto [entry, is_new] = done.try_emplace(std::minmax(s.a, s.b));
    for (int i = 1; i < pieces; ++i) {
      if (is_new)
        entry->second.push_back(graph.add_vertex(a + (static_cast<double>(i) / pieces) * (b - a), kFibrePoint));
    }
    for (int i = 1; i < pieces; ++i) {
      const Vec2 point = graph.points_um[entry->second[i - 1]];
      cuts.push_back({s.chain, s.place, norm(point - a) / norm(b - a), entry->second[i - 1]});
    }
  }
  if (!cuts.empty()) apply(graph, std::move(cuts));
}

}  // namespace mbtfm::network
