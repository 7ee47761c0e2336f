#include "network/mesh/relax.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "network/mesh/moving_mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::mesh {
namespace {

constexpr double kSpacing = 0.98;   // of the lattice, in edge lengths
constexpr double kJitter = 0.15;    // in edge lengths: enough for meshes that differ everywhere
constexpr double kClearance = 0.5;  // of the seeds from the frame

/// Whether a point keeps clear of the lines and the lone vertices of a frame.
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

/// Points at about the wanted distances, in the box of the frame and clear of its lines: a triangular lattice, turned
/// and shifted at random, each point moved at random. It is finer by powers of √3 where that is wanted:
/// lattices of spacing edge / √3^level, each containing the one before; every point of the plane takes those of the
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

// Moves and distances are in wanted edge lengths.
constexpr double kRest = 0.005;       // no vertex moves further in a sweep: the mesh is at rest
constexpr double kStill = 0.001;      // a vertex that moves less does not wake its neighbours
constexpr int kMostSweeps = 200;      // five times what an ordinary cell takes
constexpr double kLongestMove = 0.3;  // in a sweep: into the next triangle at most
constexpr int kDensityRounds = 6;     // then the number of vertices stays
constexpr int kSweepsBetween = 6;
constexpr double kTooShort = 0.6;       // a free vertex this near another is taken out …
constexpr double kTooLong = 1.45;       // … and one put into an edge this long: both about √2 off
constexpr double kWall = 0.75;          // a vertex nearer to a line of the frame is pushed away …
constexpr double kPush = 0.3;           // … by this part of what is missing
constexpr double kLongBoundary = 1.25;  // vertices do not slide further apart
constexpr double kPressed = 0.25;       // a vertex this near to a line after all is taken out
constexpr double kFinest = 0.4;         // edge length where lines of the frame are closer than that

enum class Density { even_out, thin_out };  // take out and put in, or only take out

/// An edge length of their distance where vertices of the frame are close together.
void refine_where_lines_are_close(Frame& frame) {
  const double edge = frame.size.edge_um();
  numerics::Grid near(frame.points_um, edge);
  const int n = static_cast<int>(frame.points_um.size());
  for (int v = 0; v < n; ++v) near.add(v, frame.points_um[v], frame.points_um[v]);
  std::vector<std::pair<int, double>> close;
  for (int v = 0; v < n; ++v) {
    const double wanted = frame.size.at(frame.points_um[v]);
    double spacing = wanted;
    near.for_each_near(frame.points_um[v], frame.points_um[v], wanted, [&](int other) {
      if (other != v) spacing = std::min(spacing, norm(frame.points_um[other] - frame.points_um[v]));
    });
    // an even division of the frame is no reason to refine
    if (spacing < 0.75 * wanted) close.push_back({v, std::max(spacing, kFinest * wanted)});
  }
  for (const auto& [v, spacing] : close) frame.size.refine(frame.points_um[v], spacing);
}

class Relaxation {
 public:
  Relaxation(const Frame& frame, const Boundary& boundary, std::vector<Vec2> points)
      : frame_(frame),
        boundary_(boundary),
        n_frame_(static_cast<int>(frame.points_um.size())),
        slide_s_um_(frame.ring_s_um),
        mesh_(triangulated(std::move(points))) {
    start_moving();
  }

  RelaxedMesh run() {
    RelaxedMesh result;
    Report& report = result.report;
    report.reason = "sweeps used up";
    for (int round = 0; round < kDensityRounds; ++round) {
      for (int k = 0; k < kSweepsBetween; ++k, ++report.iterations) sweep();
      if (!change_density(Density::even_out)) break;
    }
    while (!report.converged && report.iterations < kMostSweeps) {
      ++report.iterations;
      report.last_change = sweep();
      report.converged = report.last_change < kRest && !change_density(Density::thin_out);
    }
    if (report.converged) report.reason = "at rest";
    // with sweeps used up something may still crowd
    for (int round = 0; !report.converged && round < kDensityRounds; ++round)
      if (!change_density(Density::thin_out)) break;
    result.points_um = mesh_.points_um();
    result.triangulation = mesh_.triangulation();
    result.size_um = std::move(size_um_);
    return result;
  }

 private:
  MovingMesh triangulated(std::vector<Vec2> points) {
    auto triangulation = triangulate(points, frame_.segments);
    if (!triangulation && is_sliding_) {
      // sliding has made the boundary cross itself: back to where it did not, and no more sliding
      is_sliding_ = false;
      std::copy(frame_.points_um.begin(), frame_.points_um.end(), points.begin());
      triangulation = triangulate(points, frame_.segments);
    }
    if (!triangulation)
      throw InvalidData("outline and fibres", "lines that a mesh of this edge length can follow", "lines that cross");
    leave_out_unused(points, *triangulation);
    return {std::move(points), *triangulation};
  }

  /// Leave out the free vertices that no triangle uses, being outside the cell.
  void leave_out_unused(std::vector<Vec2>& points, Triangulation& triangulation) const {
    std::vector<char> is_used(points.size(), 0);
    std::fill(is_used.begin(), is_used.begin() + n_frame_, 1);
    for (const auto& t : triangulation.triangles)
      for (const int v : t) is_used[v] = 1;
    std::vector<int> number(points.size(), -1);
    int n_kept = 0;
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (!is_used[v]) continue;
      points[n_kept] = points[v];
      number[v] = n_kept++;
    }
    points.resize(n_kept);
    for (auto& t : triangulation.triangles)
      for (int& v : t) v = number[v];
    for (auto& e : triangulation.edges) {
      e.vertex_a = number[e.vertex_a];
      e.vertex_b = number[e.vertex_b];
      for (int& v : e.apexes) v = v < 0 ? v : number[v];
    }
  }

  void start_moving() {
    size_um_.clear();
    for (const Vec2 p : mesh_.points_um()) size_um_.push_back(frame_.size.at(p));
    is_awake_.assign(size_um_.size(), 1);
    damping_.assign(size_um_.size(), 1);
    last_move_um_.assign(size_um_.size(), {});
  }

  /// Move every vertex once, but those that came to rest and whose neighbours did; then renew the edges.
  /// @return the furthest move, in wanted edge lengths
  double sweep() {
    double furthest = 0;
    std::vector<int> moved;
    std::vector<char> is_awake(is_awake_.size(), 0);
    const int n = static_cast<int>(is_awake_.size());
    for (int v = 0; v < n; ++v) {
      if (!is_awake_[v]) continue;
      const double move = v >= n_frame_ ? relax(v) : slide(v);
      if (move > 0) moved.push_back(v);
      if (move < kStill) continue;
      furthest = std::max(furthest, move);
      for (const int t : mesh_.triangles_of(v))
        for (const int w : mesh_.triangles()[t]) is_awake[w] = 1;
    }
    for (const int v : mesh_.restore_delaunay(moved)) is_awake[v] = 1;
    is_awake_ = std::move(is_awake);
    return furthest;
  }

  /// To the centroid of the vertex's triangles, each weighted by its area in wanted edge lengths squared; and off the
  /// lines of the frame.
  Vec2 wanted_move(int v) const {
    const auto& points = mesh_.points_um();
    const Vec2 at = points[v];
    Vec2 sum, push;
    double weights = 0;
    for (const int t : mesh_.triangles_of(v)) {
      const auto& corners = mesh_.triangles()[t];
      const int i = corners[0] == v ? 0 : corners[1] == v ? 1 : 2;
      const int next = corners[(i + 1) % 3], after = corners[(i + 2) % 3];
      const Vec2 to_next = points[next] - at, to_after = points[after] - at;
      const double size = size_um_[v] + size_um_[next] + size_um_[after];
      const double doubled_area = cross(to_next, to_after);
      const double weight = doubled_area / (size * size);
      sum += (weight / 3) * (to_next + to_after);
      weights += weight;
      if (!mesh_.is_of_frame(t, i)) continue;
      const Vec2 wall = to_after - to_next;
      const double length = std::sqrt(dot(wall, wall));
      const double missing = kWall * size_um_[v] - doubled_area / length;
      if (missing > 0) push += (kPush * missing / length) * Vec2{-wall.y, wall.x};
    }
    return (1 / weights) * sum + push;
  }

  double relax(int v) {
    const Vec2 at = mesh_.points_um()[v];
    Vec2 move = wanted_move(v);
    const double length = norm(move) / size_um_[v];
    if (length > kLongestMove) move = (kLongestMove / length) * move;
    // flips beside a wall switch its push on and off: a vertex that goes to and fro takes ever smaller steps
    damping_[v] = dot(move, last_move_um_[v]) < 0 ? 0.5 * damping_[v] : std::min(1.0, 1.2 * damping_[v]);
    last_move_um_[v] = move;
    move = damping_[v] * move;
    constexpr int kHalvings = 4;
    for (int attempt = 0; attempt < kHalvings; ++attempt, move = 0.5 * move) {
      if (!mesh_.move(v, at + move)) continue;
      size_um_[v] = frame_.size.at(at + move);
      return norm(move) / size_um_[v];
    }
    return 0;
  }

  double slide(int v) {
    if (!is_sliding_ || !frame_.slides(v)) return 0;
    const OutlineCurve& curve = boundary_.rings()[frame_.ring[v]];
    const double reach = 0.1 * size_um_[v];
    const Vec2 chord = curve.at(slide_s_um_[v] + reach) - curve.at(slide_s_um_[v] - reach);
    const double length = norm(chord);
    if (length == 0) return 0;
    const double along = std::clamp(dot(wanted_move(v), chord) / length, -reach, reach);
    const double s = curve.wrapped(slide_s_um_[v] + along);
    if (stretches_boundary(v, curve.at(s)) || !mesh_.move(v, curve.at(s))) return 0;
    slide_s_um_[v] = s;
    size_um_[v] = frame_.size.at(curve.at(s));
    return std::abs(along) / size_um_[v];
  }

  /// A boundary edge at v would grow too long: its chord would cut off the curve, and what lies beside that.
  bool stretches_boundary(int v, Vec2 to) const {
    const auto& points = mesh_.points_um();
    for (const int t : mesh_.triangles_of(v)) {
      const auto& corners = mesh_.triangles()[t];
      for (int i = 0; i < 3; ++i) {
        if (corners[i] == v || !mesh_.is_boundary(t, i)) continue;
        const int other = corners[(i + 1) % 3] == v ? corners[(i + 2) % 3] : corners[(i + 1) % 3];
        const double now = norm(points[other] - points[v]);
        const double then = norm(points[other] - to);
        if (then > now && then > kLongBoundary * 0.5 * (size_um_[v] + size_um_[other])) return true;
      }
    }
    return false;
  }

  /// Free vertices on a line of the frame, in spite of its push: another presses from behind.
  std::vector<int> pressed_vertices() const {
    const auto& points = mesh_.points_um();
    std::vector<int> pressed;
    for (int t = 0; t < static_cast<int>(mesh_.triangles().size()); ++t) {
      const auto& corners = mesh_.triangles()[t];
      for (int i = 0; i < 3; ++i) {
        const int v = corners[i];
        if (v < n_frame_ || !mesh_.is_of_frame(t, i)) continue;
        const Vec2 a = points[corners[(i + 1) % 3]];
        const Vec2 b = points[corners[(i + 2) % 3]];
        if (cross(b - a, points[v] - a) < kPressed * size_um_[v] * norm(b - a)) pressed.push_back(v);
      }
    }
    return pressed;
  }

  /// Take out free vertices that crowd, put some into long edges; neighbours of a change wait for the next time.
  bool change_density(Density density) {
    const Triangulation now = mesh_.triangulation();
    std::vector<Vec2> points = mesh_.points_um();
    std::vector<int> order(now.edges.size());
    std::iota(order.begin(), order.end(), 0);
    std::vector<double> relative(now.edges.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      const auto& e = now.edges[k];
      relative[k] =
          norm(points[e.vertex_b] - points[e.vertex_a]) / (0.5 * (size_um_[e.vertex_a] + size_um_[e.vertex_b]));
    }
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return relative[a] < relative[b]; });
    std::vector<char> is_touched(points.size(), 0);
    std::vector<char> is_kept(points.size(), 1);
    std::vector<Vec2> added;
    const auto is_untouched = [&](const Triangulation::Edge& e) {
      return !is_touched[e.vertex_a] && !is_touched[e.vertex_b];
    };
    bool has_changed = false;
    for (const int k : order) {
      const auto& e = now.edges[k];
      if (relative[k] > kTooShort) break;
      const int free = std::max(e.vertex_a, e.vertex_b);  // the frame's vertices come first
      if (free < n_frame_ || !is_untouched(e)) continue;
      is_kept[free] = 0;
      is_touched[e.vertex_a] = is_touched[e.vertex_b] = 1;
      has_changed = true;
    }
    for (const int v : pressed_vertices()) {
      if (is_touched[v]) continue;
      is_kept[v] = 0;
      is_touched[v] = 1;
      has_changed = true;
    }
    for (auto k = order.rbegin(); density == Density::even_out && k != order.rend() && relative[*k] > kTooLong; ++k) {
      const auto& e = now.edges[*k];
      if (e.is_of_frame || !is_untouched(e)) continue;
      added.push_back(0.5 * (points[e.vertex_a] + points[e.vertex_b]));
      is_touched[e.vertex_a] = is_touched[e.vertex_b] = 1;
      for (const int apex : e.apexes)
        if (apex >= 0) is_touched[apex] = 1;
      has_changed = true;
    }
    if (!has_changed) return false;
    std::vector<Vec2> changed;
    for (std::size_t v = 0; v < points.size(); ++v)
      if (is_kept[v]) changed.push_back(points[v]);
    changed.insert(changed.end(), added.begin(), added.end());
    mesh_ = triangulated(std::move(changed));
    start_moving();
    return true;
  }

  const Frame& frame_;
  const Boundary& boundary_;
  int n_frame_;
  bool is_sliding_ = true;
  std::vector<double> slide_s_um_;  ///< of the sliding vertices
  MovingMesh mesh_;
  std::vector<double> size_um_;  ///< wanted edge length at each vertex
  std::vector<char> is_awake_;   ///< it or a neighbour has moved
  std::vector<double> damping_;  ///< of the moves of each vertex
  std::vector<Vec2> last_move_um_;
};

}  // namespace

RelaxedMesh fill_and_relax(Frame frame, const Boundary& boundary, Random& random) {
  refine_where_lines_are_close(frame);
  expect_room_for_mesh(frame.size, boundary);
  std::vector<Vec2> points = frame.points_um;
  const std::vector<Vec2> inner = places_of_seeds(frame, random);
  points.insert(points.end(), inner.begin(), inner.end());
  return Relaxation(frame, boundary, std::move(points)).run();
}

}  // namespace mbtfm::mesh
