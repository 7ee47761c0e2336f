#include "network/mesh/triangulation.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/hilbert_sort.h>
#include <CGAL/property_map.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <utility>

namespace mbtfm::mesh {
namespace {

constexpr int kUnknown = 0, kInside = 1, kOutside = 2;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using FaceBase =
    CGAL::Constrained_triangulation_face_base_2<Kernel, CGAL::Triangulation_face_base_with_info_2<int, Kernel>>;
using DataStructure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Delaunay =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, DataStructure, CGAL::No_constraint_intersection_tag>;

using Ends = std::pair<int, int>;

/// Vertices in the order of `points_um`. Inserted along a Hilbert curve, where each is near the one before.
std::vector<Delaunay::Vertex_handle> insert_points(Delaunay& delaunay, const std::vector<Vec2>& points_um) {
  std::vector<Kernel::Point_2> points;
  points.reserve(points_um.size());
  for (const Vec2 p : points_um) points.emplace_back(p.x, p.y);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto point_map = CGAL::make_property_map(points);
  CGAL::hilbert_sort(order.begin(), order.end(),
                     CGAL::Spatial_sort_traits_adapter_2<Kernel, decltype(point_map)>(point_map));
  std::vector<Delaunay::Vertex_handle> handles(points.size());
  Delaunay::Face_handle hint;
  for (const std::size_t i : order) {
    handles[i] = delaunay.insert(points[i], hint);
    handles[i]->info() = static_cast<int>(i);
    hint = handles[i]->face();
  }
  return handles;
}

/// Walk in from outside; each segment that bounds the cell is a step in or out.
void mark_inside(Delaunay& delaunay, const std::set<Ends>& bounds) {
  for (const auto& face : delaunay.all_face_handles()) face->info() = kUnknown;
  std::vector<Delaunay::Face_handle> open = {delaunay.infinite_face()};
  open.front()->info() = kOutside;
  while (!open.empty()) {
    const Delaunay::Face_handle face = open.back();
    open.pop_back();
    for (int i = 0; i < 3; ++i) {
      const Delaunay::Face_handle next = face->neighbor(i);
      if (next->info() != kUnknown) continue;
      const bool is_bound = face->is_constrained(i) && bounds.contains(std::minmax(face->vertex((i + 1) % 3)->info(),
                                                                                   face->vertex((i + 2) % 3)->info()));
      next->info() = is_bound ? kInside + kOutside - face->info() : face->info();
      open.push_back(next);
    }
  }
}

}  // namespace

std::optional<Triangulation> triangulate(const std::vector<Vec2>& points_um,
                                         const std::vector<FrameSegment>& segments) {
  Delaunay delaunay;
  const auto handles = insert_points(delaunay, points_um);
  std::set<Ends> bounds;
  try {
    for (const FrameSegment& s : segments) {
      if (handles[s.vertex_a] == handles[s.vertex_b]) return std::nullopt;
      delaunay.insert_constraint(handles[s.vertex_a], handles[s.vertex_b]);
      if (s.outline_count % 2 == 1) bounds.insert(std::minmax(s.vertex_a, s.vertex_b));
    }
  } catch (const Delaunay::Intersection_of_constraints_exception&) {
    return std::nullopt;
  }
  if (delaunay.dimension() < 2) return std::nullopt;
  mark_inside(delaunay, bounds);

  Triangulation result;
  result.triangles.reserve(2 * points_um.size());
  result.edges.reserve(3 * points_um.size());
  for (const auto& face : delaunay.finite_face_handles()) {
    if (face->info() != kInside) continue;
    std::array<int, 3> t = {face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()};
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    result.triangles.push_back(t);
  }
  for (const auto& [face, i] : delaunay.finite_edges()) {
    const Delaunay::Face_handle other = face->neighbor(i);
    if (face->info() != kInside && other->info() != kInside) continue;
    const Ends ends = std::minmax(face->vertex((i + 1) % 3)->info(), face->vertex((i + 2) % 3)->info());
    Triangulation::Edge edge{.vertex_a = ends.first, .vertex_b = ends.second, .is_of_frame = face->is_constrained(i)};
    if (face->info() == kInside) edge.apexes[0] = face->vertex(i)->info();
    if (other->info() == kInside) edge.apexes[1] = other->vertex(other->index(face))->info();
    if (edge.apexes[0] < edge.apexes[1]) std::swap(edge.apexes[0], edge.apexes[1]);
    result.edges.push_back(edge);
  }
  // CGAL's own order goes by addresses; sums over edges must not
  std::sort(result.triangles.begin(), result.triangles.end());
  std::sort(result.edges.begin(), result.edges.end(), [](const auto& a, const auto& b) {
    return std::pair(a.vertex_a, a.vertex_b) < std::pair(b.vertex_a, b.vertex_b);
  });
  return result;
}

double quality(Vec2 a, Vec2 b, Vec2 c) {
  const double ab = norm(b - a);
  const double bc = norm(c - b);
  const double ca = norm(a - c);
  const double product = ab * bc * ca;
  // r = A / s and R = abc / 4A, so 2 r / R = (b + c − a)(c + a − b)(a + b − c) / abc
  return product > 0 ? std::max(0.0, (bc + ca - ab) * (ca + ab - bc) * (ab + bc - ca) / product) : 0.0;
}

}  // namespace mbtfm::mesh
