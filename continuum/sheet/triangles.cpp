#include "continuum/sheet/triangles.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_mesh_face_base_2.h>
#include <CGAL/Delaunay_mesh_size_criteria_2.h>
#include <CGAL/Delaunay_mesh_vertex_base_2.h>
#include <CGAL/Delaunay_mesher_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/polyline.h"
#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::sheet {
namespace {

struct OnCurve {
  int curve = -1;  ///< -1: inside, or put there by the mesher
  double s_um = 0;
};

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase =
    CGAL::Triangulation_vertex_base_with_info_2<OnCurve, Kernel, CGAL::Delaunay_mesh_vertex_base_2<Kernel>>;
using FaceBase = CGAL::Delaunay_mesh_face_base_2<Kernel>;
using Delaunay =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>>;

/// How large triangles may be: at the vertices of the curves as these are apart, growing from there. Vertices are in
/// blocks of neighbours, of which most are too far away to matter.
class SizeField {
 public:
  SizeField(std::vector<Vec2> points_um, std::vector<double> sizes_um, const TriangleSize& size)
      : points_um_(std::move(points_um)), sizes_um_(std::move(sizes_um)), size_(size) {
    constexpr std::size_t kBlock = 32;
    for (std::size_t first = 0; first < points_um_.size(); first += kBlock) {
      const std::size_t end = std::min(first + kBlock, points_um_.size());
      Block block{first, end, points_um_[(first + end) / 2], 0, sizes_um_[first]};
      for (std::size_t k = first; k < end; ++k) {
        block.radius_um = std::max(block.radius_um, norm(points_um_[k] - block.centre_um));
        block.least_um = std::min(block.least_um, sizes_um_[k]);
      }
      blocks_.push_back(block);
    }
  }
  double at(Vec2 p) const {
    double least = size_.largest_um;
    for (const Block& block : blocks_) {
      if (block.least_um + size_.growth * (norm(p - block.centre_um) - block.radius_um) >= least) continue;
      for (std::size_t k = block.first; k < block.end; ++k)
        least = std::min(least, sizes_um_[k] + size_.growth * norm(p - points_um_[k]));
    }
    return least;
  }

 private:
  struct Block {
    std::size_t first, end;
    Vec2 centre_um;
    double radius_um, least_um;
  };
  std::vector<Vec2> points_um_;
  std::vector<double> sizes_um_;
  std::vector<Block> blocks_;
  TriangleSize size_;
};

/// A triangle is bad where its longest side is more than the size there, or an angle is below 20.7°.
class Criteria : public CGAL::Delaunay_mesh_criteria_2<Delaunay> {
  using Base = CGAL::Delaunay_mesh_criteria_2<Delaunay>;

 public:
  explicit Criteria(const SizeField& size) : Base(0.125), size_(&size) {}
  using Quality = CGAL::Delaunay_mesh_size_criteria_2<Delaunay>::Quality;
  class Is_bad {
   public:
    Is_bad(double bound, const SizeField& size) : bound_(bound), size_(&size) {}
    CGAL::Mesh_2::Face_badness operator()(const Quality& q) const {
      if (q.size() > 1) return CGAL::Mesh_2::IMPERATIVELY_BAD;
      return q.sine() < bound_ ? CGAL::Mesh_2::BAD : CGAL::Mesh_2::NOT_BAD;
    }
    CGAL::Mesh_2::Face_badness operator()(const Delaunay::Face_handle& face, Quality& q) const {
      std::array<Vec2, 3> p;
      for (int i = 0; i < 3; ++i) p[i] = {face->vertex(i)->point().x(), face->vertex(i)->point().y()};
      std::array<double, 3> squared;
      for (int i = 0; i < 3; ++i) squared[i] = dot(p[(i + 1) % 3] - p[i], p[(i + 1) % 3] - p[i]);
      std::sort(squared.begin(), squared.end());
      const double allowed = size_->at(1.0 / 3 * (p[0] + p[1] + p[2]));
      const double doubled_area = cross(p[1] - p[0], p[2] - p[0]);
      q.second = squared[2] / (allowed * allowed);
      q.first = q.second > 1 ? 1 : doubled_area * doubled_area / (squared[2] * squared[1]);
      return (*this)(q);
    }

   private:
    double bound_;
    const SizeField* size_;
  };
  Is_bad is_bad_object() const { return Is_bad(bound(), *size_); }

 private:
  const SizeField* size_;
};

/// On which side of a curve that turns from +x towards +y the sheet is.
enum class SheetIs { inside, outside, on_both };

SheetIs side_of(const Region& region, int curve) {
  if (curve == 0) return SheetIs::inside;
  return static_cast<std::size_t>(curve) < region.rims.size() ? SheetIs::outside : SheetIs::on_both;
}

/// The size along a curve, no steeper than its growth: smallest where it bends most.
std::vector<double> sizes_along(const Curve& curve, SheetIs where, const TriangleSize& size, double step_um) {
  const auto n = static_cast<std::size_t>(std::ceil(curve.length_um() / step_um));
  const double step = curve.length_um() / static_cast<double>(n);
  std::vector<double> sizes(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double curvature = curve.curvature_per_um((static_cast<double>(k) + 0.5) * step);
    const bool is_notch = where == SheetIs::on_both || (where == SheetIs::inside) == (curvature < 0);
    const double turn = is_notch ? std::min(size.most_notch_rad, size.most_turn_rad) : size.most_turn_rad;
    sizes[k] = std::min({size.at_curves_um, size.largest_um, turn / std::max(std::abs(curvature), 1e-300)});
  }
  for (std::size_t turn = 0; turn < 2; ++turn) {
    for (std::size_t k = 0; k < n; ++k)
      sizes[(k + 1) % n] = std::min(sizes[(k + 1) % n], sizes[k] + size.growth * step);
    for (std::size_t k = n; k-- > 0;) sizes[k] = std::min(sizes[k], sizes[(k + 1) % n] + size.growth * step);
  }
  return sizes;
}

double sample_um(const Curve& curve, const TriangleSize& size) {
  return std::min(0.25 * size.at_curves_um, curve.length_um() / 64);
}

/// Arc lengths of the vertices on a curve; its corners are among them.
std::vector<double> vertices_along(const Curve& curve, SheetIs where, const TriangleSize& size) {
  const std::vector<double> sizes = sizes_along(curve, where, size, sample_um(curve, size));
  const double per_um = static_cast<double>(sizes.size()) / curve.length_um();
  std::vector<double> ends = curve.corners_um();
  const bool is_smooth = ends.empty();
  if (is_smooth) ends.push_back(0);
  std::vector<double> vertices;
  for (std::size_t c = 0; c < ends.size(); ++c) {
    const double begin = ends[c], end = c + 1 < ends.size() ? ends[c + 1] : ends[0] + curve.length_um();
    const auto size_at = [&](double s) {
      const auto k = static_cast<std::size_t>((begin + s) * per_um) % sizes.size();
      return sizes[k];
    };
    vertices.push_back(begin);
    for (const double s : even_division_um(end - begin, size_at, is_smooth ? 8 : 2))
      vertices.push_back(std::fmod(begin + s, curve.length_um()));
  }
  return vertices;
}

struct Seeded {
  Delaunay delaunay;
  std::vector<Vec2> points_um;
  std::vector<double> sizes_um;
};

void insert_curve(Seeded& seeded, const Curve& curve, SheetIs where, int number, const TriangleSize& size) {
  const std::vector<double> vertices = vertices_along(curve, where, size);
  std::vector<Delaunay::Vertex_handle> handles;
  std::vector<Vec2> places;
  for (const double s : vertices) places.push_back(curve.at(s));
  for (std::size_t k = 0; k < places.size(); ++k) {
    handles.push_back(seeded.delaunay.insert({places[k].x, places[k].y},
                                             handles.empty() ? Delaunay::Face_handle() : handles.back()->face()));
    handles.back()->info() = {number, vertices[k]};
  }
  for (std::size_t k = 0; k < places.size(); ++k) {
    const std::size_t next = (k + 1) % places.size(), before = (k + places.size() - 1) % places.size();
    seeded.delaunay.insert_constraint(handles[k], handles[next]);
    seeded.points_um.push_back(places[k]);
    // the mesher compares it with longest sides, which are a fifth longer than a triangle's mean
    seeded.sizes_um.push_back(1.2 * std::max(norm(places[next] - places[k]), norm(places[before] - places[k])));
  }
}

/// A point just inside of a ring that turns from +x towards +y.
Vec2 point_inside(const Curve& ring) {
  const Vec2 a = ring.at(0.5 * ring.length_um()), b = ring.at(0.5 * ring.length_um() + 1e-3 * ring.length_um());
  const Vec2 along = b - a;
  for (double reach = 4; reach > 1e-3; reach /= 2) {
    const Vec2 inside = 0.5 * (a + b) + reach * Vec2{-along.y, along.x};
    if (contains(ring.points_um(), inside)) return inside;
  }
  return 0.5 * (a + b);
}

/// From s to t the short way round, at a share of it.
double between(double s, double t, double length, double share) {
  double step = std::fmod(t - s, length);
  if (step > 0.5 * length) step -= length;
  if (step < -0.5 * length) step += length;
  return s + share * step;
}

const Curve& curve_of(const Region& region, int number) {
  const auto k = static_cast<std::size_t>(number);
  return k < region.rims.size() ? region.rims[k] : region.lines[k - region.rims.size()];
}

/// Vertices that the mesher put on chords learn the curve of their neighbours there, and go onto it.
void name_split_vertices(Delaunay& delaunay, const Region& region) {
  bool is_new = true;
  while (is_new) {
    is_new = false;
    for (const auto& edge : delaunay.constrained_edges()) {
      const auto a = edge.first->vertex(Delaunay::cw(edge.second)), b = edge.first->vertex(Delaunay::ccw(edge.second));
      if ((a->info().curve < 0) == (b->info().curve < 0)) continue;
      const auto known = a->info().curve < 0 ? b : a, unknown = a->info().curve < 0 ? a : b;
      const Curve& curve = curve_of(region, known->info().curve);
      unknown->info() = {known->info().curve, curve.nearest_um({unknown->point().x(), unknown->point().y()})};
      is_new = true;
    }
  }
}

class Numbering {
 public:
  Numbering(const Region& region, Triangles& result) : region_(region), result_(result) {}

  int corner(Delaunay::Vertex_handle v) {
    const auto [at, is_new] = corner_.emplace(v, static_cast<int>(result_.nodes_um.size()));
    if (is_new) {
      const OnCurve& on = v->info();
      result_.nodes_um.push_back(on.curve < 0 ? Vec2{v->point().x(), v->point().y()}
                                              : curve_of(region_, on.curve).at(on.s_um));
      info_.push_back(on);
    }
    return at->second;
  }

  int between_corners(int a, int b, bool is_on_curve) {
    const auto [at, is_new] = middle_.emplace(std::minmax(a, b), static_cast<int>(result_.nodes_um.size()));
    if (!is_new) return at->second;
    result_.nodes_um.push_back(0.5 * (result_.nodes_um[a] + result_.nodes_um[b]));
    if (is_on_curve) {
      const Curve& curve = curve_of(region_, info_[a].curve);
      const double s = between(info_[a].s_um, info_[b].s_um, curve.length_um(), 0.5);
      const bool is_forward = between(info_[a].s_um, info_[b].s_um, curve.length_um(), 1) > info_[a].s_um;
      result_.nodes_um.back() = curve.at(s);
      result_.sides.push_back({{is_forward ? a : b, is_forward ? b : a, at->second}, info_[a].curve, s});
    }
    return at->second;
  }

 private:
  const Region& region_;
  Triangles& result_;
  std::map<Delaunay::Vertex_handle, int> corner_;
  std::map<std::pair<int, int>, int> middle_;
  std::vector<OnCurve> info_;
};

Triangles numbered(Delaunay& delaunay, const Region& region) {
  Triangles result;
  Numbering numbering(region, result);
  std::vector<Delaunay::Face_handle> faces;
  for (const auto& face : delaunay.finite_face_handles())
    if (face->is_in_domain()) faces.push_back(face);
  for (const auto& face : faces)
    result.nodes.push_back({numbering.corner(face->vertex(0)), numbering.corner(face->vertex(1)),
                            numbering.corner(face->vertex(2)), 0, 0, 0});
  result.n_corners = static_cast<int>(result.nodes_um.size());
  for (std::size_t t = 0; t < faces.size(); ++t) {
    for (int side = 0; side < 3; ++side) {
      const int apex = (side + 2) % 3;
      result.nodes[t][3 + side] = numbering.between_corners(result.nodes[t][side], result.nodes[t][(side + 1) % 3],
                                                            faces[t]->is_constrained(apex));
    }
  }
  return result;
}

}  // namespace

double expected_triangles(const Region& region, const TriangleSize& size) {
  constexpr double kMostSides = 1e6;  // beyond, the sizes along the curves would fill the memory: bends are left out
  double along = 0;
  const int n_curves = static_cast<int>(region.rims.size() + region.lines.size());
  for (int c = 0; c < n_curves; ++c) along += curve_of(region, c).length_um() / size.at_curves_um;
  const bool is_beyond = !(along < kMostSides);
  if (!is_beyond) along = 0;
  for (int c = 0; c < n_curves && !is_beyond; ++c) {
    const Curve& curve = curve_of(region, c);
    const double step = sample_um(curve, size);
    for (const double h : sizes_along(curve, side_of(region, c), size, step)) along += step / h;
  }
  // of a strip whose triangles grow: each layer has fewer by its growth; what is left inside is even
  const double layers = 2.3 * along / std::max(size.growth, 0.05);
  const double even =
      std::abs(signed_area_um2(region.rims.front().points_um())) / (0.43 * size.at_curves_um * size.at_curves_um);
  const double inside =
      std::abs(signed_area_um2(region.rims.front().points_um())) / (0.43 * size.largest_um * size.largest_um);
  return std::min(layers + inside, std::max(even, along));
}

Triangles triangulated(const Region& region, const TriangleSize& size, std::size_t most) {
  if (expected_triangles(region, size) > static_cast<double>(most))
    throw InvalidData("the mesh", "at most " + std::to_string(most) + " triangles",
                      "about " + brief(expected_triangles(region, size)) + " of " + brief(size.at_curves_um) + " um");
  Seeded seeded;
  int number = 0;
  for (const std::vector<Curve>* curves : {&region.rims, &region.lines})
    for (const Curve& curve : *curves) {
      insert_curve(seeded, curve, side_of(region, number), number, size);
      ++number;
    }
  std::list<Kernel::Point_2> holes;
  for (std::size_t r = 1; r < region.rims.size(); ++r) {
    const Vec2 inside = point_inside(region.rims[r]);
    holes.emplace_back(inside.x, inside.y);
  }
  const SizeField field(seeded.points_um, seeded.sizes_um, size);
  CGAL::Delaunay_mesher_2<Delaunay, Criteria> mesher(seeded.delaunay, Criteria(field));
  mesher.set_seeds(holes.begin(), holes.end(), false);
  mesher.refine_mesh();
  name_split_vertices(seeded.delaunay, region);
  return numbered(seeded.delaunay, region);
}

}  // namespace mbtfm::sheet
