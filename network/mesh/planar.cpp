#include "network/mesh/planar.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "network/mesh/polyline.h"
#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::mesh {
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
    for (int i = 0; i < (chain.is_closed ? n : n - 1); ++i)
      segments.push_back({c, i, chain.vertices[i], chain.vertices[(i + 1) % n]});
  }
  return segments;
}

std::vector<char> used_vertices(const PlanarGraph& graph) {
  std::vector<char> is_used(graph.points_um.size(), 0);
  for (const Chain& chain : graph.chains)
    for (const int v : chain.vertices) is_used[v] = 1;
  for (std::size_t v = 0; v < is_used.size(); ++v) is_used[v] |= graph.rank[v] == kHeld;
  return is_used;
}

/// Take out detours to a vertex and straight back (but to an adhesion's): splitting at close vertices would add to
/// them in every round.
void collapse_backtracks(const PlanarGraph& graph, std::vector<int>& vertices) {
  std::vector<int> straight;
  for (const int v : vertices) {
    if (!straight.empty() && straight.back() == v) continue;
    if (straight.size() > 1 && straight[straight.size() - 2] == v && graph.rank[straight.back()] != kHeld) {
      straight.pop_back();
      continue;
    }
    straight.push_back(v);
  }
  vertices = std::move(straight);
}

/// Replace every vertex by the one it merged into; no chain names a vertex twice in a row.
void rename(PlanarGraph& graph, const std::vector<int>& name) {
  for (Chain& chain : graph.chains) {
    for (int& v : chain.vertices) v = name[v];
    collapse_backtracks(graph, chain.vertices);
    while (chain.is_closed && chain.vertices.size() > 1 && chain.vertices.front() == chain.vertices.back())
      chain.vertices.pop_back();
  }
  std::erase_if(graph.chains, [](const Chain& chain) { return chain.vertices.size() < 2; });
}

bool merge_close(PlanarGraph& graph, const SizeField& size, double relative_tolerance) {
  const std::vector<char> is_used = used_vertices(graph);
  // by falling rank, then by index, so that the one that stays is found first
  std::vector<int> order(graph.points_um.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return graph.rank[a] > graph.rank[b]; });
  std::vector<int> name(graph.points_um.size());
  std::iota(name.begin(), name.end(), 0);
  numerics::Grid kept(graph.points_um, relative_tolerance * size.edge_um());
  bool has_changed = false;
  for (const int v : order) {
    if (!is_used[v]) continue;
    const double tolerance = relative_tolerance * size.at(graph.points_um[v]);
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
      for (; next < cuts.size() && cuts[next].chain == c && cuts[next].place == i; ++next)
        longer[c].push_back(cuts[next].vertex);
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

bool is_outline(const Chain& chain) { return chain.fibre_id == 0 && chain.adhesion_id == 0; }

/// The chain passes through v a few segments before or after: to go there again would make a knot that grows.
bool is_nearby(const Chain& chain, int place, int v) {
  if (is_outline(chain)) return false;  // a whisker of it comes back along itself
  constexpr int kReach = 4;
  const int n = static_cast<int>(chain.vertices.size());
  for (int i = place - kReach; i <= place + 1 + kReach; ++i) {
    if (!chain.is_closed && (i < 0 || i >= n)) continue;
    if (chain.vertices[((i % n) + n) % n] == v) return true;
  }
  return false;
}

bool split_at_close_vertices(PlanarGraph& graph, const SizeField& size, double relative_tolerance) {
  const std::vector<Segment> segments = segments_of(graph);
  const std::vector<char> is_used = used_vertices(graph);
  numerics::Grid vertices(graph.points_um, segment_grid_cell(graph, segments));
  for (int v = 0; v < static_cast<int>(graph.points_um.size()); ++v)
    if (is_used[v]) vertices.add(v, graph.points_um[v], graph.points_um[v]);
  const double widest = relative_tolerance * size.edge_um();
  std::vector<Cut> cuts;
  for (const Segment& s : segments) {
    const Vec2 a = graph.points_um[s.a];
    const Vec2 step = graph.points_um[s.b] - a;
    vertices.for_each_near(a, graph.points_um[s.b], widest, [&](int v) {
      if (v == s.a || v == s.b || is_nearby(graph.chains[s.chain], s.place, v)) return;
      const double along = dot(graph.points_um[v] - a, step) / dot(step, step);
      if (along <= 0 || along >= 1) return;
      const double distance = norm(graph.points_um[v] - (a + along * step));
      if (distance < widest && distance < relative_tolerance * size.at(graph.points_um[v]))
        cuts.push_back({s.chain, s.place, along, v});
    });
  }
  if (cuts.empty()) return false;
  apply(graph, std::move(cuts));
  return true;
}

int rank_of_points(const Chain& chain) {
  return chain.adhesion_id > 0 ? kRimPoint : chain.fibre_id > 0 ? kFibrePoint : kOutlinePoint;
}

/// A fibre stays straight where it crosses a rim: points of the rim give way.
int rank_of_crossing(const Chain& a, const Chain& b) {
  if ((a.fibre_id > 0 && b.adhesion_id > 0) || (a.adhesion_id > 0 && b.fibre_id > 0)) return kFibreEnd;
  return std::max(rank_of_points(a), rank_of_points(b));
}

bool cross_segments(PlanarGraph& graph) {
  const std::vector<Segment> segments = segments_of(graph);
  numerics::Grid index(graph.points_um, segment_grid_cell(graph, segments));
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
      const int rank = rank_of_crossing(graph.chains[s.chain], graph.chains[t.chain]);
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

/// Whether a chain has to keep the vertex, for each of them.
std::vector<char> kept_vertices(const PlanarGraph& graph) {
  constexpr double kKink = 25 * std::numbers::pi / 180;
  const std::size_t n = graph.points_um.size();
  std::vector<std::set<int>> neighbours(n);
  std::vector<char> is_kept(n, 0);
  for (const Segment& s : segments_of(graph)) {
    neighbours[s.a].insert(s.b);
    neighbours[s.b].insert(s.a);
  }
  for (const Chain& chain : graph.chains) {
    if (!chain.is_closed) is_kept[chain.vertices.front()] = is_kept[chain.vertices.back()] = 1;
    for (std::size_t i = 1; chain.fibre_id > 0 && i + 1 < chain.vertices.size(); ++i) {
      const Vec2 at = graph.points_um[chain.vertices[i]];
      const Vec2 before = at - graph.points_um[chain.vertices[i - 1]];
      const Vec2 after = graph.points_um[chain.vertices[i + 1]] - at;
      if (std::abs(std::atan2(cross(before, after), dot(before, after))) > kKink) is_kept[chain.vertices[i]] = 1;
    }
  }
  for (std::size_t v = 0; v < n; ++v) is_kept[v] |= graph.rank[v] == kHeld || neighbours[v].size() != 2;
  return is_kept;
}

/// New vertices in the place of the inner ones of a run between two that stay.
std::vector<int> divide_run(PlanarGraph& graph, const std::vector<int>& run, int rank, const SizeField& size) {
  Polyline line;
  for (const int v : run) line.push_back(graph.points_um[v]);
  const int fewest = run.front() == run.back() ? 4 : 1;
  std::vector<int> inner;
  for (const Vec2 p : evenly_divided(line, size, fewest)) inner.push_back(graph.add_vertex(p, rank));
  return inner;
}

}  // namespace

bool make_planar(PlanarGraph& graph, const SizeField& size, double tolerance) {
  for (int round = 0; round < kMaxRounds; ++round) {
    bool has_changed = cross_segments(graph);
    has_changed = merge_close(graph, size, tolerance) || has_changed;
    has_changed = split_at_close_vertices(graph, size, tolerance) || has_changed;
    if (!has_changed) return true;
  }
  return false;
}

void divide_evenly(PlanarGraph& graph, const SizeField& size) {
  const std::vector<char> is_kept = kept_vertices(graph);
  std::map<std::vector<int>, std::vector<int>> done;  // runs that several chains share get the same vertices
  for (Chain& chain : graph.chains) {
    if (is_outline(chain)) continue;
    if (chain.is_closed) {
      const auto first = std::find_if(chain.vertices.begin(), chain.vertices.end(), [&](int v) { return is_kept[v]; });
      if (first != chain.vertices.end()) std::rotate(chain.vertices.begin(), first, chain.vertices.end());
      chain.vertices.push_back(chain.vertices.front());
    }
    std::vector<int> divided = {chain.vertices.front()};
    std::vector<int> run = divided;
    for (std::size_t i = 1; i < chain.vertices.size(); ++i) {
      run.push_back(chain.vertices[i]);
      if (!is_kept[run.back()] && i + 1 < chain.vertices.size()) continue;
      std::vector<int> back(run.rbegin(), run.rend());
      const bool is_forward = run <= back;
      const auto [entry, is_new] = done.try_emplace(is_forward ? run : back);
      if (is_new) entry->second = divide_run(graph, entry->first, rank_of_points(chain), size);
      const std::vector<int>& inner = entry->second;
      if (is_forward)
        divided.insert(divided.end(), inner.begin(), inner.end());
      else
        divided.insert(divided.end(), inner.rbegin(), inner.rend());
      divided.push_back(run.back());
      run = {run.back()};
    }
    if (chain.is_closed) divided.pop_back();
    chain.vertices = std::move(divided);
  }
}

}  // namespace mbtfm::mesh
