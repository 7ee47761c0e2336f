#include "substrate/surface/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <ranges>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::surface {
namespace {

using Corners = std::array<Vec3, 3>;

constexpr const char* kMesh = "mesh of the surface";
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Vec2 plan(Vec3 p) { return {p.x, p.y}; }

Corners corners_of(const TriangleMesh& mesh, const std::array<int, 3>& triangle) {
  return {mesh.points_um[triangle[0]], mesh.points_um[triangle[1]], mesh.points_um[triangle[2]]};
}

/// Seen along z; positive from +x towards +y.
double plan_area(const Corners& t) { return 0.5 * cross(plan(t[1]) - plan(t[0]), plan(t[2]) - plan(t[0])); }

double longest_plan_edge(const Corners& t) {
  double longest = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, norm(plan(t[(k + 1) % 3]) - plan(t[k])));
  return longest;
}

Extent extent_of(const TriangleMesh& mesh) {
  return mbtfm::extent_of(mesh.triangles | std::views::join, [&](int corner) { return mesh.points_um[corner]; });
}

double largest_coordinate_um(const TriangleMesh& mesh) {
  double largest = 0;
  for (const int corner : mesh.triangles | std::views::join) {
    const Vec3 p = mesh.points_um[corner];
    largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  return largest;
}

HeightMap lattice_over(const Extent& extent, double spacing_um) {
  constexpr double kMost = 2e7;  // vertices: 0.6 GB while they are found
  const Vec2 size = extent.high_um - extent.low_um;
  // a size that is a multiple but for rounding gets no further vertex
  const auto n_along = [&](double length) { return std::max(4.0, std::ceil(length / spacing_um - 1e-9) + 1); };
  const double n_x = n_along(size.x), n_y = n_along(size.y);
  if (!(n_x * n_y <= kMost)) {
    throw InvalidData(kMesh, "a spacing that makes at most twenty million vertices",
                      brief(spacing_um) + " um over " + brief(size.x) + " x " + brief(size.y) + " um");
  }
  HeightMap map{.origin_um = extent.low_um,
                .spacing_um = {size.x / (n_x - 1), size.y / (n_y - 1)},
                .n_x = static_cast<int>(n_x),
                .n_y = static_cast<int>(n_y),
                .z_um = {},
                .sigma_um = {}};
  map.z_um.assign(static_cast<std::size_t>(map.n_x) * map.n_y, kNone);
  return map;
}

/// Where the lattice has a hundred vertices to a triangle, or ten thousand if these are more: what is finer repeats the
/// planes of a few large triangles, at a cost that has nothing to do with the mesh's size.
double finest_spacing_um(const Extent& extent, std::size_t n_triangles) {
  const double most = 1e4 + 100 * static_cast<double>(n_triangles);
  const Vec2 size = extent.high_um - extent.low_um;
  // four lines run along even the narrowest strip
  return std::max(std::sqrt(size.x * size.y / most), 4 * std::max(size.x, size.y) / most);
}

/// Every edge has two triangles. Points at one place count as one.
bool is_closed(const TriangleMesh& mesh) {
  std::vector<int> order(mesh.points_um.size()), place(mesh.points_um.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int k) { return std::array{mesh.points_um[k].x, mesh.points_um[k].y, mesh.points_um[k].z}; };
  std::ranges::sort(order, {}, key);
  for (std::size_t k = 1; k < order.size(); ++k)
    place[order[k]] = place[order[k - 1]] + (key(order[k]) != key(order[k - 1]) ? 1 : 0);
  std::vector<std::pair<int, int>> edges;
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(place[t[k]], place[t[(k + 1) % 3]]);
      if (a != b) edges.emplace_back(a, b);
    }
  }
  std::ranges::sort(edges);
  for (auto edge = edges.begin(); edge != edges.end();) {
    const auto next = std::find_if(edge, edges.end(), [&](const auto& other) { return other != *edge; });
    if ((next - edge) % 2 != 0) return false;
    edge = next;
  }
  return true;
}

[[noreturn]] void refuse_two_heights(const TriangleMesh& mesh, Vec2 at, double z_a, double z_b) {
  if (is_closed(mesh)) {
    throw InvalidData(kMesh, "one height over each place: cut the mesh to the upper surface of the gel",
                      "a closed mesh");
  }
  throw InvalidData(kMesh, "a height field, one height over each place",
                    "an overhang at x, y = " + brief(at.x) + ", " + brief(at.y) + " um: heights z of " +
                        brief(std::min(z_a, z_b)) + " and " + brief(std::max(z_a, z_b)) + " um");
}

/// A height field covers its extent once at most, twice where each face is there with its back; what covers it again
/// and again would be looked at as often.
void require_one_layer(const TriangleMesh& mesh, const Extent& extent) {
  constexpr double kMost = 4;
  double covered = 0;
  for (const auto& triangle : mesh.triangles) covered += std::abs(plan_area(corners_of(mesh, triangle)));
  const Vec2 size = extent.high_um - extent.low_um;
  if (covered <= kMost * size.x * size.y) return;
  throw InvalidData(kMesh, "a height field, one height over each place",
                    "triangles that cover its extent " + brief(covered / (size.x * size.y)) + " times");
}

/// Where a line along z meets a triangle, or passes it within rounding.
struct Hit {
  double z_um = 0;
  double inside = -1;  ///< the least of the corners' weights
  double slope = 0;
};

class Sampler {
 public:
  Sampler(const TriangleMesh& mesh, double spacing_um)
      : mesh_(mesh),
        map_(lattice_over(extent_of(mesh), spacing_um)),
        reach_um_(largest_coordinate_um(mesh) * std::numeric_limits<float>::epsilon()),
        jump_um_(1e-3 * std::min(map_.spacing_um.x, map_.spacing_um.y) + 2 * reach_um_),
        hits_(map_.z_um.size()) {}

  void add(const Corners& t) {
    const double longest = longest_plan_edge(t), area = plan_area(t);
    // a triangle that rounding can turn over is upright
    if (2 * std::abs(area) <= reach_um_ * longest) {
      refuse_jump(t, longest);
      return;
    }
    (area > 0 ? n_positive_ : n_negative_) += 1;
    const double slope = slope_of(t);
    const auto [y_low, y_high] = std::minmax({t[0].y, t[1].y, t[2].y});
    const int j_end = last(y_high, map_.origin_um.y, map_.spacing_um.y, map_.n_y);
    for (int j = first(y_low, map_.origin_um.y, map_.spacing_um.y); j <= j_end; ++j) {
      const auto [x_low, x_high] = across(t, map_.origin_um.y + j * map_.spacing_um.y);
      if (x_low > x_high) continue;  // past it by rounding
      const int i_end = last(x_high, map_.origin_um.x, map_.spacing_um.x, map_.n_x);
      for (int i = first(x_low, map_.origin_um.x, map_.spacing_um.x); i <= i_end; ++i) meet(t, slope, area, i, j);
    }
  }

  MeshSurface surface() && {
    for (std::size_t k = 0; k < hits_.size(); ++k) {
      if (is_hit(hits_[k])) map_.z_um[k] = hits_[k].z_um;
    }
    return {.map = std::move(map_), .n_flipped = std::min(n_positive_, n_negative_)};
  }

 private:
  static constexpr double kMissed = -1;
  static bool is_hit(const Hit& hit) { return hit.inside > kMissed; }

  /// Lattice lines within reach of an interval.
  int first(double low, double origin, double spacing) const {
    return std::max(0, static_cast<int>(std::ceil((low - reach_um_ - origin) / spacing)));
  }
  int last(double high, double origin, double spacing, int n) const {
    return std::min(n - 1, static_cast<int>(std::floor((high + reach_um_ - origin) / spacing)));
  }

  /// What a triangle spans along x within reach of a line y: of a sliver that lies askew little of its extent.
  std::pair<double, double> across(const Corners& t, double y) const {
    std::pair span(std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity());
    for (int k = 0; k < 3; ++k) {
      const bool rises = t[k].y <= t[(k + 1) % 3].y;
      const Vec3 low = t[rises ? k : (k + 1) % 3], high = t[rises ? (k + 1) % 3 : k];
      if (high.y < y - reach_um_ || low.y > y + reach_um_) continue;
      const double slope = high.y > low.y ? (high.x - low.x) / (high.y - low.y) : 0;
      const auto x_at = [&](double at) {
        return at <= low.y ? low.x : at >= high.y ? high.x : low.x + slope * (at - low.y);
      };
      for (const double x : {x_at(y - reach_um_), x_at(y + reach_um_)})
        span = {std::min(span.first, x), std::max(span.second, x)};
      if (high.y == low.y) span = {std::min({span.first, low.x, high.x}), std::max({span.second, low.x, high.x})};
    }
    return span;
  }

  static double slope_of(const Corners& t) {
    const Vec3 normal = cross(t[1] - t[0], t[2] - t[0]);
    return std::hypot(normal.x, normal.y) / std::abs(normal.z);
  }

  void meet(const Corners& t, double slope, double area, int i, int j) {
    const Vec2 at = map_.origin_um + Vec2{i * map_.spacing_um.x, j * map_.spacing_um.y};
    std::array<double, 3> weight{};
    for (int k = 0; k < 3; ++k) {
      const Vec2 a = plan(t[(k + 1) % 3]), b = plan(t[(k + 2) % 3]);
      const double twice_area = cross(a - at, b - at) * (area > 0 ? 1 : -1);
      if (twice_area < -reach_um_ * norm(b - a)) return;
      weight[k] = twice_area / (2 * std::abs(area));
    }
    const double inside = std::max(std::ranges::min(weight), -0.5);  // of a sliver, far from 0 for all that
    // within reach, but outside: the nearest of the edge counts, no continuation of a steep triangle
    for (double& w : weight) w = std::max(w, 0.0);
    const double z =
        (weight[0] * t[0].z + weight[1] * t[1].z + weight[2] * t[2].z) / (weight[0] + weight[1] + weight[2]);
    Hit& before = hits_[static_cast<std::size_t>(j) * map_.n_x + i];
    if (is_hit(before) && std::abs(z - before.z_um) > jump_um_ + reach_um_ * (slope + before.slope))
      refuse_two_heights(mesh_, at, z, before.z_um);
    if (inside > before.inside) before = {.z_um = z, .inside = inside, .slope = slope};
  }

  /// The wall's height over its middle corner, seen along z; all of it, where it is one line.
  void refuse_jump(Corners t, double longest) const {
    if (longest <= reach_um_) {
      const auto [low, high] = std::minmax({t[0].z, t[1].z, t[2].z});
      if (high - low > jump_um_) refuse_two_heights(mesh_, plan(t[0]), low, high);
      return;
    }
    const auto edge = [&](int k) { return norm(plan(t[(k + 2) % 3]) - plan(t[(k + 1) % 3])); };  // opposite to corner k
    int middle = 0;
    for (int k = 1; k < 3; ++k) {
      if (edge(k) > edge(middle)) middle = k;
    }
    const Vec3 a = t[(middle + 1) % 3], b = t[(middle + 2) % 3], m = t[middle];
    const Vec2 along = plan(b) - plan(a);
    const double share = dot(plan(m) - plan(a), along) / dot(along, along);
    const double z = a.z + share * (b.z - a.z);
    const double slope = std::abs(b.z - a.z) / longest;
    // two corners over one place: how far apart in plan they are is rounding
    if (std::abs(z - m.z) > jump_um_ + reach_um_ * slope) refuse_two_heights(mesh_, plan(m), z, m.z);
  }

  const TriangleMesh& mesh_;
  HeightMap map_;
  double reach_um_;  ///< rounding of coordinates that were floats
  double jump_um_;   ///< what differs less is one height
  std::vector<Hit> hits_;
  int n_positive_ = 0, n_negative_ = 0;
};

}  // namespace

double suggested_spacing_um(const TriangleMesh& mesh) {
  check(mesh);
  std::vector<double> lengths_um;
  lengths_um.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    const Corners t = corners_of(mesh, triangle);
    for (int k = 0; k < 3; ++k) {
      const double length = norm(plan(t[(k + 1) % 3]) - plan(t[k]));
      if (length > 0) lengths_um.push_back(length);
    }
  }
  if (lengths_um.empty()) throw InvalidData(kMesh, "triangles that span an area, seen along z", "none");
  const auto middle = lengths_um.begin() + static_cast<std::ptrdiff_t>(lengths_um.size() / 2);
  std::nth_element(lengths_um.begin(), middle, lengths_um.end());
  return std::max(*middle, finest_spacing_um(extent_of(mesh), mesh.triangles.size()));
}

MeshSurface sample_mesh(const TriangleMesh& mesh, double spacing_um) {
  check(mesh);
  if (mesh.triangles.empty()) throw InvalidData(kMesh, "triangles", "none");
  if (!(spacing_um > 0 && std::isfinite(spacing_um)))
    throw InvalidData("spacing of the surface's lattice", "a length above 0", brief(spacing_um) + " um");
  const Extent extent = extent_of(mesh);
  if (!(extent.high_um.x > extent.low_um.x && extent.high_um.y > extent.low_um.y))
    throw InvalidData(kMesh, "triangles that span an area, seen along z", "all above one line");
  require_one_layer(mesh, extent);
  Sampler sampler(mesh, spacing_um);
  for (const auto& triangle : mesh.triangles) sampler.add(corners_of(mesh, triangle));
  return std::move(sampler).surface();
}

}  // namespace mbtfm::surface
