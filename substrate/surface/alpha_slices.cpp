#include "substrate/surface/alpha_slices.h"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <string>
#include <tuple>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::surface {
namespace {

constexpr double kStrays = 0.02;  ///< of a slice's beads
constexpr int kUnseen = 0;        ///< face of no piece yet

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using FaceBase = CGAL::Triangulation_face_base_with_info_2<int, Kernel>;
using Triangulation = CGAL::Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<CGAL::Triangulation_vertex_base_2<Kernel>, FaceBase>>;
using Face = Triangulation::Face_handle;

/// From here on x is along the slices' row, y across it.
std::vector<Vec3> turned(std::vector<Vec3> beads, SlicesAlong along) {
  if (along == SlicesAlong::kY) {
    for (Vec3& p : beads) std::swap(p.x, p.y);
  }
  return beads;
}
HeightMap turned_back(const HeightMap& map, SlicesAlong along) {
  if (along == SlicesAlong::kX) return map;
  HeightMap back{.origin_um = {map.origin_um.y, map.origin_um.x},
                 .spacing_um = {map.spacing_um.y, map.spacing_um.x},
                 .n_x = map.n_y,
                 .n_y = map.n_x,
                 .z_um = {},
                 .sigma_um = {}};
  for (int i = 0; i < map.n_x; ++i) {
    for (int j = 0; j < map.n_y; ++j) back.z_um.push_back(map.z_um[static_cast<std::size_t>(j) * map.n_x + i]);
  }
  return back;
}

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double v) { low = std::min(low, v), high = std::max(high, v); }
  double size() const { return high - low; }
};

struct BeadExtent {
  Range x, y;
  double apart_um = 0;  ///< n^(-1/3)
};

void check_distinct(const std::vector<Vec3>& beads) {
  std::vector<int> order(beads.size());
  std::iota(order.begin(), order.end(), 0);
  const auto place = [&](int k) { return std::tie(beads[k].x, beads[k].y, beads[k].z); };
  std::ranges::sort(order, [&](int a, int b) { return place(a) < place(b); });
  const auto twin = std::ranges::adjacent_find(order, [&](int a, int b) { return place(a) == place(b); });
  if (twin == order.end()) return;
  throw InvalidData("bead " + std::to_string(std::max(twin[0], twin[1])), "each bead once",
                    "the place of bead " + std::to_string(std::min(twin[0], twin[1])));
}

BeadExtent extent_of(const std::vector<Vec3>& beads) {
  constexpr std::size_t kFewest = 30;
  if (beads.size() < kFewest)
    throw InvalidData("beads in the gel", "at least " + std::to_string(kFewest), std::to_string(beads.size()));
  BeadExtent extent;
  std::vector<double> z_um;
  for (std::size_t k = 0; k < beads.size(); ++k) {
    if (!is_finite(beads[k])) throw InvalidData("bead " + std::to_string(k), "finite numbers", "others");
    extent.x.add(beads[k].x);
    extent.y.add(beads[k].y);
    z_um.push_back(beads[k].z);
  }
  check_distinct(beads);
  const double depth = numerics::quantile(z_um, 0.99) - numerics::quantile(z_um, 0.01);  // few may lie far off
  const double volume = extent.x.size() * extent.y.size() * depth;
  if (!(volume > 0)) throw InvalidData("beads in the gel", "beads all over a volume", "all in one plane or line");
  extent.apart_um = std::cbrt(volume / static_cast<double>(beads.size()));
  return extent;
}

/// Square of the radius of the circle through a triangle's corners. CGAL's own divides by the area, which rounding may
/// make zero; its Alpha_shape_2, too, which is why the triangles are chosen here.
double circle_um2(Face face) {
  const auto corner = [&](int k) { return Vec2{face->vertex(k)->point().x(), face->vertex(k)->point().y()}; };
  const Vec2 a = corner(1) - corner(0), b = corner(2) - corner(0), c = b - a;
  const double twice_area = std::abs(mbtfm::cross(a, b));
  const double lengths = mbtfm::norm(a) * mbtfm::norm(b) * mbtfm::norm(c);
  constexpr double kSliver = 1e-12;  // of the longest sides: no circle of any use
  if (twice_area <= kSliver * std::max(dot(a, a), dot(b, b))) return std::numeric_limits<double>::infinity();
  return std::pow(lengths / (2 * twice_area), 2);
}

struct Piece {
  std::vector<Face> faces;
  std::size_t n_beads = 0;
};

/// Triangles joined by sides to `first`, none with a wider circle.
Piece piece_from(const Triangulation& triangulation, Face first, double radius_um2, int mark) {
  Piece piece;
  std::set<Triangulation::Vertex_handle> beads;
  piece.faces = {first};
  first->info() = mark;
  for (std::size_t k = 0; k < piece.faces.size(); ++k) {
    const Face face = piece.faces[k];
    for (int side = 0; side < 3; ++side) {
      beads.insert(face->vertex(side));
      const Face next = face->neighbor(side);
      if (triangulation.is_infinite(next) || next->info() != kUnseen || circle_um2(next) > radius_um2) continue;
      next->info() = mark;
      piece.faces.push_back(next);
    }
  }
  piece.n_beads = beads.size();
  return piece;
}

/// Beads of one slice; `y` across, z down.
struct Slice {
  std::string place;
  Triangulation triangulation;

  Piece largest_piece(double radius_um2) const {
    for (const Face face : triangulation.finite_face_handles()) face->info() = kUnseen;
    Piece largest;
    int mark = kUnseen;
    for (const Face face : triangulation.finite_face_handles()) {
      if (face->info() != kUnseen || circle_um2(face) > radius_um2) continue;
      Piece piece = piece_from(triangulation, face, radius_um2, ++mark);
      if (piece.n_beads > largest.n_beads) largest = std::move(piece);
    }
    return largest;
  }

  /// The smallest with which one piece holds all beads but strays: the piece grows with the circle.
  double smallest_circle_um2() const {
    const std::size_t n = triangulation.number_of_vertices();
    const std::size_t n_strays = std::max<std::size_t>(1, static_cast<std::size_t>(kStrays * static_cast<double>(n)));
    std::vector<double> circles;
    for (const Face face : triangulation.finite_face_handles()) {
      if (const double circle = circle_um2(face); std::isfinite(circle)) circles.push_back(circle);
    }
    std::ranges::sort(circles);
    const auto enough = std::ranges::partition_point(
        circles, [&](double circle) { return largest_piece(circle).n_beads + n_strays < n; });
    if (enough == circles.end()) throw InvalidData(place, "beads that make one solid piece", "beads near one line");
    return *enough;
  }
};

std::vector<Slice> cut(const std::vector<Vec3>& beads, const Range& x, double width_um) {
  constexpr double kFewest = 3;
  const double n = std::floor(x.size() / width_um);
  if (!(n >= 2 && kFewest * n <= static_cast<double>(beads.size())))
    throw InvalidData("slices of beads", "at least two of them, with at least 3 beads each",
                      brief(n) + " of " + brief(width_um) + " um for " + std::to_string(beads.size()) + " beads");
  const auto n_slices = static_cast<std::size_t>(n);
  const double width = x.size() / n;
  std::vector<std::vector<Kernel::Point_2>> points(n_slices);
  for (const Vec3& bead : beads) {
    points[std::min(n_slices - 1, static_cast<std::size_t>((bead.x - x.low) / width))].emplace_back(bead.y, bead.z);
  }
  std::vector<Slice> slices(n_slices);
  for (std::size_t k = 0; k < n_slices; ++k) {
    Slice& slice = slices[k];
    const double begin = x.low + static_cast<double>(k) * width;
    slice.place = "beads in the slice from " + brief(begin) + " to " + brief(begin + width) + " um";
    slice.triangulation.insert(points[k].begin(), points[k].end());  // those behind each other count once
    if (slice.triangulation.number_of_vertices() < static_cast<std::size_t>(kFewest))
      throw InvalidData(slice.place, "at least 3 behind no other",
                        std::to_string(slice.triangulation.number_of_vertices()));
    if (slice.triangulation.dimension() < 2) throw InvalidData(slice.place, "beads all over it", "all on one line");
  }
  return slices;
}

/// The upper boundary of a piece: the highest of its sides over each place.
struct Outline {
  std::vector<std::array<Vec2, 2>> sides;  ///< (y, z), y rising
  Range y;

  explicit Outline(const Piece& piece) {
    for (const Face face : piece.faces) {
      for (int k = 0; k < 3; ++k) {
        const auto &p = face->vertex(k)->point(), &q = face->vertex((k + 1) % 3)->point();
        const Vec2 a = {p.x(), p.y()}, b = {q.x(), q.y()};
        sides.push_back(a.x <= b.x ? std::array{a, b} : std::array{b, a});
        y.add(a.x);
      }
    }
  }
  double height_um(double at) const {
    double height = std::numeric_limits<double>::infinity();
    for (const auto& [a, b] : sides) {
      if (at < a.x || at > b.x) continue;
      const double t = b.x > a.x ? (at - a.x) / (b.x - a.x) : 0;
      height = std::min({height, (1 - t) * a.y + t * b.y, b.x > a.x ? height : b.y});
    }
    return height;
  }
};

/// Places at most `spacing` apart that fill a range.
struct Row {
  double low, spacing;
  int n;
  double at(int k) const { return low + k * spacing; }
};
Row row_over(const Range& range, double spacing_um) {
  constexpr double kMost = 1e4;
  const double n = std::ceil(range.size() / spacing_um * (1 - 1e-12));
  if (!(n >= 3 && n <= kMost))
    throw InvalidData("surface from slices of beads", "4 to 10000 vertices along each side",
                      brief(range.size()) + " um at " + brief(spacing_um) + " um");
  return {range.low, range.size() / n, static_cast<int>(n) + 1};
}

std::vector<Outline> outlines_of(const std::vector<Slice>& slices, double radius_um, const Range& y) {
  double circle = radius_um * radius_um;
  if (radius_um == 0) {
    for (const Slice& slice : slices) circle = std::max(circle, slice.smallest_circle_um2());
  }
  std::vector<Outline> outlines;
  for (const Slice& slice : slices) {
    outlines.emplace_back(slice.largest_piece(circle));
    if (!(outlines.back().y.size() >= 0.5 * y.size()))
      throw InvalidData(slice.place, "one solid piece of them as wide as the gel",
                        "one of " + brief(std::max(0.0, outlines.back().y.size())) + " um with a circle of " +
                            brief(std::sqrt(circle)) + " um: make it or the slices wider");
  }
  return outlines;
}

HeightMap stitched(const std::vector<Outline>& outlines, const Range& x, double spacing_um) {
  const double width = x.size() / static_cast<double>(outlines.size());
  Range y = outlines.front().y;
  for (const Outline& o : outlines) y = {std::max(y.low, o.y.low), std::min(y.high, o.y.high)};
  const Row along = row_over({x.low + 0.5 * width, x.high - 0.5 * width}, spacing_um), across = row_over(y, spacing_um);
  HeightMap map{.origin_um = {along.low, across.low},
                .spacing_um = {along.spacing, across.spacing},
                .n_x = along.n,
                .n_y = across.n,
                .z_um = {},
                .sigma_um = {}};
  for (int j = 0; j < across.n; ++j) {
    const double at = std::min(across.at(j), y.high);
    std::vector<double> heights;
    for (const Outline& o : outlines) heights.push_back(o.height_um(at));
    for (int i = 0; i < along.n; ++i) {
      const double place = (along.at(i) - along.low) / width;
      const auto k = std::min(heights.size() - 2, static_cast<std::size_t>(std::max(0.0, place)));
      const double t = std::min(1.0, place - static_cast<double>(k));
      map.z_um.push_back((1 - t) * heights[k] + t * heights[k + 1]);
    }
  }
  return map;
}

}  // namespace

HeightMap alpha_shape_surface(const std::vector<Vec3>& beads_um, const AlphaParameters& parameters, double spacing_um) {
  MBTFM_ASSERT(parameters.slice_um >= 0 && parameters.radius_um >= 0 && spacing_um > 0);
  const std::vector<Vec3> beads = turned(beads_um, parameters.along);
  const BeadExtent extent = extent_of(beads);
  const double width = parameters.slice_um > 0 ? parameters.slice_um : 2 * extent.apart_um;
  const std::vector<Slice> slices = cut(beads, extent.x, width);
  const std::vector<Outline> outlines = outlines_of(slices, parameters.radius_um, extent.y);
  HeightMap map = turned_back(stitched(outlines, extent.x, spacing_um), parameters.along);
  check(map);
  return map;
}

}  // namespace mbtfm::surface
