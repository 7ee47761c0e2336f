#include "network/mesh/seeds.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::mesh {
namespace {

constexpr double kSpacing = 0.98;   // of the lattice, in edge lengths
constexpr double kJitter = 0.15;    // in edge lengths: enough for meshes that differ everywhere
constexpr double kClearance = 0.5;  // of the seeds from the frame
// Discs at saturation cover 0.547 of the plane: with this distance they are as many as the lattice's points
constexpr double kDiscDistance = 0.76;

struct Box {
  Vec2 low, high;
  bool has(Vec2 p) const { return p.x >= low.x && p.y >= low.y && p.x <= high.x && p.y <= high.y; }
};

Box box_of(const std::vector<Vec2>& points) {
  Box box = {points.front(), points.front()};
  for (const Vec2 p : points) {
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y)};
  }
  return box;
}

/// Tells whether a point keeps clear of the lines and the lone vertices of a frame.
class Clearance {
 public:
  explicit Clearance(const Frame& frame) : frame_(frame), grid_(frame.points_um, 0.5 * frame.size.edge_um()) {
    std::vector<char> is_on_segment(frame.points_um.size(), 0);
    for (int k = 0; k < static_cast<int>(frame.segments.size()); ++k) {
      const FrameSegment& s = frame.segments[k];
      grid_.add(k, frame.points_um[s.vertex_a], frame.points_um[s.vertex_b]);
      is_on_segment[s.vertex_a] = is_on_segment[s.vertex_b] = 1;
    }
    for (int v = 0; v < static_cast<int>(is_on_segment.size()); ++v) {
      if (!is_on_segment[v]) grid_.add(-1 - v, frame.points_um[v], frame.points_um[v]);
    }
  }

  bool is_clear(Vec2 p) {
    const double clearance = kClearance * frame_.size.at(p);
    bool is_clear = true;
    grid_.for_each_near(p, p, clearance, [&](int item) {
      if (!is_clear) return;
      const Vec2 a = frame_.points_um[item < 0 ? -1 - item : frame_.segments[item].vertex_a];
      const Vec2 b = item < 0 ? a : frame_.points_um[frame_.segments[item].vertex_b];
      is_clear = (item < 0 ? norm(p - a) : distance_to_segment_um(p, a, b)) > clearance;
    });
    return is_clear;
  }

 private:
  const Frame& frame_;
  numerics::Grid grid_;
};

/// Lattices of spacing edge / √3^level, each containing the one before; every point of the plane takes those of the
/// level that it wants.
std::vector<Vec2> lattice(const Frame& frame, double jitter, Random& random) {
  const double edge = frame.size.edge_um();
  const Box box = box_of(frame.points_um);
  Clearance clearance(frame);
  double finest = edge;
  for (const Vec2 p : frame.points_um) finest = std::min(finest, frame.size.at(p));
  const auto level_of = [&](double size) {
    return static_cast<int>(std::lround(2 * std::log(edge / size) / std::log(3.0)));
  };
  const double angle = random.uniform(0, std::numbers::pi / 3);
  const double shift_along = random.uniform();
  const double shift_up = random.uniform();
  const auto direction = [](double a) { return Vec2{std::cos(a), std::sin(a)}; };
  const Vec2 origin =
      0.5 * (box.low + box.high) +
      kSpacing * edge * (shift_along * direction(angle) + shift_up * direction(angle + std::numbers::pi / 3));
  std::vector<Vec2> points;
  for (int level = 0; level <= level_of(finest); ++level) {
    const double spacing = kSpacing * edge / std::pow(std::numbers::sqrt3, level);
    const Vec2 along = spacing * direction(angle + level * std::numbers::pi / 6);
    const Vec2 up = spacing * direction(angle + level * std::numbers::pi / 6 + std::numbers::pi / 3);
    const int reach = static_cast<int>((norm(box.high - box.low) + 2 * edge) / spacing) + 2;  // times 2/√3 of the half
    for (int j = -reach; j <= reach; ++j) {
      for (int i = -reach; i <= reach; ++i) {
        const Vec2 p = origin + static_cast<double>(i) * along + static_cast<double>(j) * up;
        if (!box.has(p)) continue;
        const double size = frame.size.at(p);
        if (level_of(size) != level) continue;
        const Vec2 seed = p + jitter * size * Vec2{random.uniform(-1, 1), random.uniform(-1, 1)};
        if (clearance.is_clear(seed)) points.push_back(seed);
      }
    }
  }
  return points;
}

/// Candidates on a jittered grid, in random order; each is taken that keeps its distance from those before.
std::vector<Vec2> poisson_discs(const Frame& frame, Random& random) {
  constexpr double kCandidates = 0.25;  // grid step in finest wanted lengths: more gain less than 1 % of points
  const Box box = box_of(frame.points_um);
  Clearance clearance(frame);
  std::vector<Vec2> candidates;
  // a bin of the size of an edge holds as many candidates as its own wanted length asks for
  const double bin = 0.5 * frame.size.edge_um();
  for (double y = box.low.y; y < box.high.y; y += bin) {
    for (double x = box.low.x; x < box.high.x; x += bin) {
      const double step = kCandidates * frame.size.at({x + 0.5 * bin, y + 0.5 * bin});
      const int n = static_cast<int>(std::ceil(bin / step));
      for (int k = 0; k < n * n; ++k) {
        candidates.push_back({x + bin * (k % n + random.uniform()) / n, y + bin * (k / n + random.uniform()) / n});
      }
    }
  }
  for (std::size_t i = candidates.size(); i > 1; --i) {
    std::swap(candidates[i - 1], candidates[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);
  }
  numerics::Grid taken(candidates, frame.size.edge_um());
  std::vector<Vec2> points;
  for (const Vec2 p : candidates) {
    const double distance = kDiscDistance * frame.size.at(p);
    if (!box.has(p) || !clearance.is_clear(p)) continue;
    bool is_free = true;
    taken.for_each_near(p, p, distance, [&](int i) { is_free = is_free && norm(points[i] - p) >= distance; });
    if (!is_free) continue;
    taken.add(static_cast<int>(points.size()), p, p);
    points.push_back(p);
  }
  return points;
}

}  // namespace

std::vector<Vec2> places_of_seeds(const Frame& frame, Seeds kind, Random& random) {
  if (kind == Seeds::poisson) return poisson_discs(frame, random);
  return lattice(frame, kind == Seeds::regular ? 0 : kJitter, random);
}

}  // namespace mbtfm::mesh
