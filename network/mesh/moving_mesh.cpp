#include "network/mesh/moving_mesh.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mbtfm::mesh {
namespace {

constexpr int next(int i) { return i == 2 ? 0 : i + 1; }
constexpr int previous(int i) { return i == 0 ? 2 : i - 1; }

int place_of(const std::array<int, 3>& values, int value) {
  return values[0] == value ? 0 : values[1] == value ? 1 : 2;
}

}  // namespace

MovingMesh::MovingMesh(std::vector<Vec2> points_um, const Triangulation& triangulation)
    : points_um_(std::move(points_um)), vertices_(triangulation.triangles) {
  join_neighbours(triangulation);
  index_stars();
}

void MovingMesh::join_neighbours(const Triangulation& triangulation) {
  struct SideOf {
    int low, high, triangle, side;
  };
  std::vector<SideOf> sides;
  sides.reserve(3 * vertices_.size());
  for (int t = 0; t < static_cast<int>(vertices_.size()); ++t) {
    for (int i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax(vertices_[t][next(i)], vertices_[t][previous(i)]);
      sides.push_back({low, high, t, i});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const SideOf& a, const SideOf& b) {
    return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
  });
  neighbours_.assign(vertices_.size(), {-1, -1, -1});
  is_fixed_.assign(vertices_.size(), {0, 0, 0});
  auto edge = triangulation.edges.begin();  // in the same order
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const SideOf& s = sides[k];
    while (std::pair(edge->vertex_a, edge->vertex_b) < std::pair(s.low, s.high)) ++edge;
    is_fixed_[s.triangle][s.side] = edge->is_of_frame;
    if (k + 1 == sides.size() || sides[k + 1].low != s.low || sides[k + 1].high != s.high) continue;
    neighbours_[s.triangle][s.side] = sides[k + 1].triangle;
    neighbours_[sides[k + 1].triangle][sides[k + 1].side] = s.triangle;
  }
}

void MovingMesh::index_stars() {
  star_begin_.assign(points_um_.size() + 1, 0);
  for (const auto& t : vertices_)
    for (const int v : t) ++star_begin_[v + 1];
  for (std::size_t v = 0; v < points_um_.size(); ++v) star_begin_[v + 1] += star_begin_[v];
  stars_.resize(3 * vertices_.size());
  std::vector<int> filled(star_begin_.begin(), star_begin_.end() - 1);
  for (int t = 0; t < static_cast<int>(vertices_.size()); ++t)
    for (const int v : vertices_[t]) stars_[filled[v]++] = t;
}

bool MovingMesh::move(int vertex, Vec2 to_um) {
  constexpr double kLeastHeight = 0.05;  // over the base: nearly flat triangles could not flip back by rounding
  for (const int t : triangles_of(vertex)) {
    const int i = place_of(vertices_[t], vertex);
    const Vec2 b = points_um_[vertices_[t][next(i)]];
    const Vec2 base = points_um_[vertices_[t][previous(i)]] - b;
    const double now = cross(base, points_um_[vertex] - b);
    const double then = cross(base, to_um - b);
    if (then < kLeastHeight * dot(base, base) && then < now) return false;
  }
  points_um_[vertex] = to_um;
  return true;
}

/// The angles across from the edge add up to more than pi.
bool MovingMesh::should_flip(int triangle, int side) const {
  const int other = neighbours_[triangle][side];
  if (other < 0 || is_fixed_[triangle][side]) return false;
  const Vec2 a = points_um_[vertices_[triangle][side]];
  const Vec2 b = points_um_[vertices_[triangle][next(side)]];
  const Vec2 c = points_um_[vertices_[triangle][previous(side)]];
  const Vec2 d = points_um_[vertices_[other][place_of(neighbours_[other], triangle)]];
  const double cos_a = dot(b - a, c - a);
  const double sin_a = cross(b - a, c - a);
  const double cos_d = dot(c - d, b - d);
  const double sin_d = cross(c - d, b - d);
  constexpr double kTie = 1e-10;  // of four points on a circle either edge will do; never flip to and fro
  return sin_a * cos_d + cos_a * sin_d <
         -kTie * (std::abs(sin_a) + std::abs(cos_a)) * (std::abs(sin_d) + std::abs(cos_d));
}

void MovingMesh::turn_neighbour(int triangle, int from, int to) {
  if (triangle >= 0) neighbours_[triangle][place_of(neighbours_[triangle], from)] = to;
}

/// Triangles (a b c) and (d c b) on the edge bc become (a b d) and (a d c).
void MovingMesh::flip(int t, int side) {
  const int u = neighbours_[t][side];
  const int far = place_of(neighbours_[u], t);
  const int a = vertices_[t][side], b = vertices_[t][next(side)], c = vertices_[t][previous(side)];
  const int d = vertices_[u][far];
  const int across_b = neighbours_[t][next(side)], across_c = neighbours_[t][previous(side)];
  const int across_c_in_u = neighbours_[u][next(far)], across_b_in_u = neighbours_[u][previous(far)];
  const char fixed_b = is_fixed_[t][next(side)], fixed_c = is_fixed_[t][previous(side)];
  const char fixed_c_in_u = is_fixed_[u][next(far)], fixed_b_in_u = is_fixed_[u][previous(far)];
  vertices_[t] = {a, b, d};
  neighbours_[t] = {across_c_in_u, u, across_c};
  is_fixed_[t] = {fixed_c_in_u, 0, fixed_c};
  vertices_[u] = {a, d, c};
  neighbours_[u] = {across_b_in_u, across_b, t};
  is_fixed_[u] = {fixed_b_in_u, fixed_b, 0};
  turn_neighbour(across_c_in_u, u, t);
  turn_neighbour(across_b, t, u);
}

std::vector<int> MovingMesh::restore_delaunay(const std::vector<int>& moved) {
  std::vector<std::pair<int, int>> open;
  for (const int v : moved) {
    for (const int t : triangles_of(v)) {
      for (int i = 0; i < 3; ++i)
        if (should_flip(t, i)) open.push_back({t, i});
    }
  }
  std::vector<int> changed;
  // each flip lowers the energy of the lifted surface, so that this ends; rounding could make it circle
  std::size_t most = 20 * vertices_.size();
  while (!open.empty() && most-- > 0) {
    const auto [t, i] = open.back();
    open.pop_back();
    if (!should_flip(t, i)) continue;
    const int u = neighbours_[t][i];
    flip(t, i);
    for (const int triangle : {t, u}) {
      for (int k = 0; k < 3; ++k) {
        open.push_back({triangle, k});
        changed.push_back(vertices_[triangle][k]);
      }
    }
  }
  if (!changed.empty()) index_stars();
  return changed;
}

Triangulation MovingMesh::triangulation() const {
  Triangulation result;
  result.triangles = vertices_;
  for (auto& t : result.triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(result.triangles.begin(), result.triangles.end());
  for (int t = 0; t < static_cast<int>(vertices_.size()); ++t) {
    for (int i = 0; i < 3; ++i) {
      const int other = neighbours_[t][i];
      if (other >= 0 && other < t) continue;
      const auto [a, b] = std::minmax(vertices_[t][next(i)], vertices_[t][previous(i)]);
      Triangulation::Edge edge{.vertex_a = a, .vertex_b = b, .is_of_frame = is_fixed_[t][i] != 0};
      edge.apexes[0] = vertices_[t][i];
      if (other >= 0) edge.apexes[1] = vertices_[other][place_of(neighbours_[other], t)];
      if (edge.apexes[0] < edge.apexes[1]) std::swap(edge.apexes[0], edge.apexes[1]);
      result.edges.push_back(edge);
    }
  }
  std::sort(result.edges.begin(), result.edges.end(), [](const auto& a, const auto& b) {
    return std::pair(a.vertex_a, a.vertex_b) < std::pair(b.vertex_a, b.vertex_b);
  });
  return result;
}

}  // namespace mbtfm::mesh
