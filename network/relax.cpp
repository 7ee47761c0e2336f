#include "network/relax.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "network/grid.h"
#include "network/moving_mesh.h"
#include "network/seeds.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::network {
namespace {

constexpr double kOverlength = 1.2;
constexpr double kStep = 0.3;
constexpr double kRest = 0.005;
constexpr int kMaxSweeps = 200;
constexpr int kDensityRounds = 6;
constexpr int kSweepsBetween = 6;
constexpr double kTooShort = 0.6;
constexpr double kTooLong = 1.45;
constexpr double kFinest = 0.4;
constexpr double kWall = 0.75;

const int kMethod = getenv("M") ? atoi(getenv("M")) : 0;
const double kPower = getenv("P") ? atof(getenv("P")) : 4;

void refine_where_lines_are_close(Frame& frame) {
  const double edge = frame.size.edge_um();
  Grid near(frame.points_um, edge);
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
        slide_(frame.ring_s_um),
        mesh_(triangulated(std::move(points))) {
    measure_sizes();
  }

  RelaxedMesh run() {
    RelaxedMesh result;
    result.report.reason = "sweeps used up";
    for (int round = 0; round < kDensityRounds; ++round) {
      for (int k = 0; k < kSweepsBetween; ++k) sweep();
      result.report.iterations += kSweepsBetween;
      if (!change_density(true)) break;
    }
    for (; result.report.iterations < kMaxSweeps; ++result.report.iterations) {
      result.report.last_change = sweep();
      if (result.report.last_change < kRest) {
        result.report.converged = true;
        result.report.reason = "at rest";
        break;
      }
    }
    for (int pass = 0; pass < 4 && change_density(false); ++pass) {
      for (int k = 0; k < 8; ++k) sweep();
    }
    if (getenv("DBG")) for (auto& t : mesh_.triangles()) {
      auto& P = mesh_.points_um();
      double q = quality(P[t[0]], P[t[1]], P[t[2]]);
      if (q < 0.2) { printf("q %.4f:", q); for (int v : t) printf(" %d(%.3f,%.3f)h%.2f%s%s%s", v, P[v].x, P[v].y, size_[v], v < n_frame_ ? "F" : "", v < n_frame_ && frame_.slides(v) ? "S" : "", v < n_frame_ && frame_.adhesion_id[v] ? "A" : v < n_frame_ && frame_.rim_adhesion_id[v] ? "R" : ""); printf("\n"); }
    }
    result.points_um = mesh_.points_um();
    result.triangulation = mesh_.triangulation();
    result.size_um = std::move(size_);
    return result;
  }

 private:
  MovingMesh triangulated(std::vector<Vec2> points) {
    auto triangulation = triangulate(points, frame_.segments);
    if (!triangulation) {
      is_sliding_ = false;
      std::copy(frame_.points_um.begin(), frame_.points_um.end(), points.begin());
      triangulation = triangulate(points, frame_.segments);
      if (!triangulation) {
        throw InvalidData("outline and fibres", "lines that a mesh of this edge length can follow",
                          "lines that cross again and again");
      }
    }
    leave_out_unused(points, *triangulation);
    return {std::move(points), *triangulation};
  }

  void leave_out_unused(std::vector<Vec2>& points, Triangulation& triangulation) const {
    std::vector<char> is_used(points.size(), 0);
    std::fill(is_used.begin(), is_used.begin() + n_frame_, 1);
    for (const auto& t : triangulation.triangles) {
      for (const int v : t) is_used[v] = 1;
    }
    std::vector<int> number(points.size(), -1);
    int n_kept = 0;
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (!is_used[v]) continue;
      points[n_kept] = points[v];
      number[v] = n_kept++;
    }
    points.resize(n_kept);
    for (auto& t : triangulation.triangles) {
      for (int& v : t) v = number[v];
    }
    for (auto& e : triangulation.edges) {
      e.vertex_a = number[e.vertex_a];
      e.vertex_b = number[e.vertex_b];
      for (int& v : e.apexes) v = v < 0 ? v : number[v];
    }
  }

  void measure_sizes() {
    size_.clear();
    for (const Vec2 p : mesh_.points_um()) size_.push_back(frame_.size.at(p));
  }

  double sweep() {
    double furthest = 0;
    const int n = static_cast<int>(mesh_.points_um().size());
    for (int v = 0; v < n; ++v) {
      if (v >= n_frame_) {
        furthest = std::max(furthest, relax(v));
      } else if (is_sliding_ && frame_.slides(v)) {
        slide(v);
      }
    }
    mesh_.restore_delaunay();
    return furthest;
  }

  Vec2 spring_step(int v) const {
    const auto& points = mesh_.points_um();
    Vec2 force;
    for (const int t : mesh_.triangles_of(v)) {
      const auto& corners = mesh_.triangles()[t];
      int at = 0;
      for (int i = 0; i < 3; ++i) {
        const int w = corners[i];
        if (w == v) {
          at = i;
          continue;
        }
        const Vec2 gap = points[v] - points[w];
        const double length = std::sqrt(dot(gap, gap));
        const double wanted = kOverlength * 0.5 * (size_[v] + size_[w]);
        // an edge inside is seen from both its triangles
        const double weight = mesh_.is_boundary(t, 3 - i - corner_of(corners, v)) ? 1 : 0.5;
        if (length < wanted) force += (weight * (wanted - length) / length) * gap;
      }
      if (mesh_.is_of_frame(t, at)) force += push_off_wall(points[v], points[corners[(at + 1) % 3]], points[corners[(at + 2) % 3]], size_[v]);
    }
    return kStep * force;
  }

  static int corner_of(const std::array<int, 3>& corners, int v) { return corners[0] == v ? 0 : corners[1] == v ? 1 : 2; }

  static Vec2 push_off_wall(Vec2 at, Vec2 a, Vec2 b, double size) {
    const double length = std::sqrt(dot(b - a, b - a));
    const Vec2 normal = (1 / length) * Vec2{a.y - b.y, b.x - a.x};
    return std::max(0.0, kWall * size - dot(at - a, normal)) * normal;
  }

  Vec2 patch_step(int v) const {
    const auto& points = mesh_.points_um();
    Vec2 sum;
    double weights = 0;
    for (const int t : mesh_.triangles_of(v)) {
      const auto& corners = mesh_.triangles()[t];
      const Vec2 a = points[corners[0]], b = points[corners[1]], c = points[corners[2]];
      const Vec2 centroid = (1.0 / 3) * (a + b + c);
      const double h = frame_.size.at(centroid);
      const double doubled = cross(b - a, c - a);
      const double weight = doubled / std::pow(h, kPower);
      Vec2 centre = centroid;
      if (kMethod == 2) {
        const Vec2 ab = b - a, ac = c - a;
        const double bb = dot(ab, ab), cc = dot(ac, ac);
        centre = a + (0.5 / doubled) * Vec2{ac.y * bb - ab.y * cc, ab.x * cc - ac.x * bb};
        const Vec2 off = centre - centroid;
        const double len = norm(off);
        if (len > h) centre = centroid + (h / len) * off;
      }
      sum += weight * centre;
      weights += weight;
    }
    return (1 / weights) * sum - points[v];
  }

  double relax(int v) {
    const Vec2 at = mesh_.points_um()[v];
    const double size = size_[v];
    Vec2 step = kMethod == 0 ? spring_step(v) : patch_step(v);
    const double length = norm(step);
    if (length > 0.3 * size) step = (0.3 * size / length) * step;
    for (int attempt = 0; attempt < 4; ++attempt, step = 0.5 * step) {
      if (!mesh_.move(v, at + step)) continue;
      size_[v] = frame_.size.at(at + step);
      return norm(step) / size;
    }
    return 0;
  }

  void slide(int v) {
    const OutlineCurve& curve = boundary_.rings()[frame_.ring[v]];
    const double reach = 0.1 * size_[v];
    const Vec2 chord = curve.at(slide_[v] + reach) - curve.at(slide_[v] - reach);
    const double length = norm(chord);
    if (length == 0) return;
    const double along = std::clamp(dot(spring_step(v), chord) / length, -reach, reach);
    const double s = curve.wrapped(slide_[v] + along);
    if (!mesh_.move(v, curve.at(s))) return;
    slide_[v] = s;
    size_[v] = frame_.size.at(curve.at(s));
  }

  bool change_density(bool adds) {
    const Triangulation now = mesh_.triangulation();
    std::vector<Vec2> points = mesh_.points_um();
    std::vector<int> order(now.edges.size());
    std::iota(order.begin(), order.end(), 0);
    std::vector<double> relative(now.edges.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      const auto& e = now.edges[k];
      relative[k] = norm(points[e.vertex_b] - points[e.vertex_a]) /
                    frame_.size.at(0.5 * (points[e.vertex_a] + points[e.vertex_b]));
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
    for (auto k = order.rbegin(); adds && k != order.rend() && relative[*k] > kTooLong; ++k) {
      const auto& e = now.edges[*k];
      if (e.is_of_frame || !is_untouched(e)) continue;
      added.push_back(0.5 * (points[e.vertex_a] + points[e.vertex_b]));
      is_touched[e.vertex_a] = is_touched[e.vertex_b] = 1;
      for (const int apex : e.apexes) {
        if (apex >= 0) is_touched[apex] = 1;
      }
      has_changed = true;
    }
    if (!has_changed) return false;
    std::vector<Vec2> kept;
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (is_kept[v]) kept.push_back(points[v]);
    }
    kept.insert(kept.end(), added.begin(), added.end());
    mesh_ = triangulated(std::move(kept));
    measure_sizes();
    return true;
  }

  const Frame& frame_;
  const Boundary& boundary_;
  int n_frame_;
  bool is_sliding_ = true;
  std::vector<double> slide_;
  std::vector<double> size_;  ///< wanted at each vertex
  MovingMesh mesh_;
};

}  // namespace

RelaxedMesh fill_and_relax(Frame frame, const Boundary& boundary, const std::string& kind, Random& random) {
  refine_where_lines_are_close(frame);
  std::vector<Vec2> points = frame.points_um;
  const std::vector<Vec2> inner = seeds(frame, kind, random);
  points.insert(points.end(), inner.begin(), inner.end());
  return Relaxation(frame, boundary, std::move(points)).run();
}

}  // namespace mbtfm::network
