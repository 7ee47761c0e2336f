#include "substrate/surface/alpha_slices.h"

#include <CGAL/Alpha_shape_2.h>
#include <CGAL/Alpha_shape_face_base_2.h>
#include <CGAL/Alpha_shape_vertex_base_2.h>
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::surface {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Alpha_shape_vertex_base_2<Kernel>;
using FaceBase = CGAL::Alpha_shape_face_base_2<Kernel>;
using Triangulation =
    CGAL::Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>>;
using AlphaShape = CGAL::Alpha_shape_2<Triangulation>;

struct Extents {
  Vec3 low, high;
};
Extents extents_of(const std::vector<Vec3>& beads) {
  constexpr std::size_t kFewest = 30;
  if (beads.size() < kFewest)
    throw InvalidData("beads in the gel", "at least " + std::to_string(kFewest), std::to_string(beads.size()));
  Extents e{beads[0], beads[0]};
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const Vec3& p = beads[i];
    if (!is_finite(p)) throw InvalidData("bead " + std::to_string(i), "finite coordinates", "NaN or infinity");
    e.low = {std::min(e.low.x, p.x), std::min(e.low.y, p.y), std::min(e.low.z, p.z)};
    e.high = {std::max(e.high.x, p.x), std::max(e.high.y, p.y), std::max(e.high.z, p.z)};
  }
  const Vec3 size = e.high - e.low;
  if (!(std::min({size.x, size.y, size.z}) > 0))
    throw InvalidData("beads in the gel", "beads all over a volume", "all in one plane or line");
  return e;
}

/// Of the shape's edges over a place the least z; nothing where there is none.
std::optional<double> upper_rim(const std::vector<Kernel::Segment_2>& edges, double y) {
  std::optional<double> least;
  for (const auto& edge : edges) {
    const auto [a, b] = std::minmax(edge.source(), edge.target());
    if (y < a.x() || y > b.x()) continue;
    const double width = b.x() - a.x();
    const double z = width > 0 ? a.y() + (b.y() - a.y()) * (y - a.x()) / width : std::min(a.y(), b.y());
    least = std::min(least.value_or(z), z);
  }
  return least;
}

/// Heights of one slice at even places; where the shape does not reach, that of its nearest place.
std::vector<double> heights_of_slice(const std::vector<Kernel::Point_2>& beads, double radius_um, double low_y,
                                     double spacing, int n, const std::string& name) {
  std::vector<std::optional<double>> rim(static_cast<std::size_t>(n));
  if (beads.size() >= 3) {
    AlphaShape shape(beads.begin(), beads.end(), radius_um * radius_um, AlphaShape::REGULARIZED);
    std::vector<Kernel::Segment_2> edges;
    for (auto e = shape.alpha_shape_edges_begin(); e != shape.alpha_shape_edges_end(); ++e)
      edges.push_back(shape.segment(*e));
    for (int j = 0; j < n; ++j) rim[static_cast<std::size_t>(j)] = upper_rim(edges, low_y + j * spacing);
  }
  std::vector<double> heights;
  for (int j = 0; j < n; ++j) {
    std::optional<double> nearest;
    for (int away = 0; away < n && !nearest; ++away) {
      for (const int k : {j - away, j + away}) {
        if (k >= 0 && k < n && rim[static_cast<std::size_t>(k)] && !nearest) nearest = rim[static_cast<std::size_t>(k)];
      }
    }
    if (!nearest)
      throw InvalidData(name, "beads that make a shape", std::to_string(beads.size()) + " beads: take wider slices");
    heights.push_back(*nearest);
  }
  return heights;
}

}  // namespace

HeightMap alpha_shape_surface(const std::vector<Vec3>& beads_um, const AlphaParameters& parameters, double spacing_um) {
  const auto [low, high] = extents_of(beads_um);
  const Vec3 size = high - low;
  std::vector<double> depths;
  for (const Vec3& p : beads_um) depths.push_back(p.z);
  const double depth = numerics::quantile(depths, 0.99) - numerics::quantile(depths, 0.01);
  const double density = static_cast<double>(beads_um.size()) / (size.x * size.y * depth);
  const double wanted = parameters.slice_um > 0 ? parameters.slice_um : 2 / std::cbrt(density);
  const int n_slices = static_cast<int>(std::floor(size.x / wanted + 1e-9));
  const int n_y = 1 + static_cast<int>(std::ceil(size.y / spacing_um - 1e-9));
  if (n_slices < 4 || n_y < 4)
    throw InvalidData("slices of " + brief(wanted) + " um", "four at least", std::to_string(n_slices));
  const double width = size.x / n_slices;
  const double n_in_slice = static_cast<double>(beads_um.size()) / n_slices;
  const double per_um2 = density * width;
  // circles of area a are empty with probability exp(-a n): one of as many as there are beads
  const double radius = parameters.radius_um > 0
                            ? parameters.radius_um
                            : std::sqrt(std::log(std::max(3.0, n_in_slice)) / (std::numbers::pi * per_um2));
  std::vector<std::vector<Kernel::Point_2>> slices(static_cast<std::size_t>(n_slices));
  for (const Vec3& p : beads_um) {
    const int slice = std::clamp(static_cast<int>((p.x - low.x) / width), 0, n_slices - 1);
    slices[static_cast<std::size_t>(slice)].emplace_back(p.y, p.z);
  }
  HeightMap map{.origin_um = {low.x + 0.5 * width, low.y},
                .spacing_um = {width, size.y / (n_y - 1)},
                .n_x = n_slices,
                .n_y = n_y,
                .z_um = std::vector<double>(static_cast<std::size_t>(n_slices) * n_y),
                .sigma_um = {}};
  for (int i = 0; i < n_slices; ++i) {
    const std::string name = "slice at x = " + brief(map.origin_um.x + i * width) + " um";
    const auto heights =
        heights_of_slice(slices[static_cast<std::size_t>(i)], radius, low.y, map.spacing_um.y, n_y, name);
    for (int j = 0; j < n_y; ++j)
      map.z_um[static_cast<std::size_t>(j) * n_slices + i] = heights[static_cast<std::size_t>(j)];
  }
  check(map);
  return map;
}

}  // namespace mbtfm::surface
