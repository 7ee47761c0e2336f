#include "network/mesh/seeds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/extent.h"
#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::mesh {
namespace {

constexpr double kSpacing = 0.98;   // of the lattice, in edge lengths
constexpr double kJitter = 0.15;    // in edge lengths: enough for meshes that differ everywhere
constexpr double kClearance = 0.5;  // of the seeds from the frame

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
    for (int v = 0; v < static_cast<int>(is_on_segment.size()); ++v)
      if (!is_on_segment[v]) grid_.add(-1 - v, frame.points_um[v], frame.points_um[v]);
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

}  // namespace

/// Lattices of spacing edge / √3^level, each containing the one before; every point of the plane takes those of the
/// level that it wants.
std::vector<Vec2> places_of_seeds(const Frame& frame, Random& random) {
  const double edge = frame.size.edge_um();
  const auto [low, high] = extent_of(frame.points_um);
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
      0.5 * (low + high) +
      kSpacing * edge * (shift_along * direction(angle) + shift_up * direction(angle + std::numbers::pi / 3));
  std::vector<Vec2> points;
  for (int level = 0; level <= level_of(finest); ++level) {
    const double spacing = kSpacing * edge / std::pow(std::numbers::sqrt3, level);
    const Vec2 along = spacing * direction(angle + level * std::numbers::pi / 6);
    const Vec2 up = spacing * direction(angle + level * std::numbers::pi / 6 + std::numbers::pi / 3);
    const int reach = static_cast<int>((norm(high - low) + 2 * edge) / spacing) + 2;  // times 2/√3 of the half
    for (int j = -reach; j <= reach; ++j) {
      for (int i = -reach; i <= reach; ++i) {
        const Vec2 p = origin + static_cast<double>(i) * along + static_cast<double>(j) * up;
        if (p.x < low.x || p.y < low.y || p.x > high.x || p.y > high.y) continue;
        const double size = frame.size.at(p);
        if (level_of(size) != level) continue;
        const Vec2 seed = p + kJitter * size * Vec2{random.uniform(-1, 1), random.uniform(-1, 1)};
        if (clearance.is_clear(seed)) points.push_back(seed);
      }
    }
  }
  return points;
}

}  // namespace mbtfm::mesh
