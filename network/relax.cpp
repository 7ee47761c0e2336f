#include "network/relax.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "network/grid.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::network {
namespace {

// Of Persson & Strang: springs are this much longer than wanted, so that nearly all push; the step; the move after
// which the triangulation is renewed, and the move below which the mesh is at rest (in edge lengths).
constexpr double kOverlength = 1.2;
constexpr double kStep = 0.2;
constexpr double kRenew = 0.1;
constexpr double kRest = 0.002;
constexpr int kMaxSteps = 160;
constexpr int kLastDensityStep = 90;  // later the number of vertices stays
constexpr int kDensityInterval = 15;

constexpr double kSpacing = 0.98;
constexpr double kJitter = 0.15;    // of the seeds, in edge lengths: enough for meshes that differ everywhere
constexpr double kClearance = 0.5;  // of the seeds from the frame
constexpr double kTooShort = 0.5;   // a vertex this near another is taken out …
constexpr double kTooLong = 1.45;   // … and one put into an edge this long
constexpr double kWall = 0.75;      // a vertex nearer to a segment of the frame than this is pushed away
constexpr double kFinest = 0.4;     // edge length where the frame is finer than that
constexpr double kGrading = 0.3;    // growth of the edge length with distance from there

/// The wanted edge length: `edge`, but less near vertices of the frame that are closer together.
class Size {
 public:
  Size(const Frame& frame, double edge) : edge_(edge), grid_(frame.points_um, edge) {
    Grid near(frame.points_um, edge);
    const int n = static_cast<int>(frame.points_um.size());
    for (int v = 0; v < n; ++v) near.add(v, frame.points_um[v], frame.points_um[v]);
    for (int v = 0; v < n; ++v) {
      double spacing = edge;
      near.for_each_near(frame.points_um[v], frame.points_um[v], edge, [&](int other) {
        if (other != v) spacing = std::min(spacing, norm(frame.points_um[other] - frame.points_um[v]));
      });
      if (spacing >= 0.75 * edge) continue;  // an even division of the frame is no reason to refine
      const int item = static_cast<int>(fine_.size());
      fine_.push_back({frame.points_um[v], std::max(spacing, kFinest * edge)});
      grid_.add(item, frame.points_um[v], frame.points_um[v]);
    }
  }

  double at(Vec2 point) {
    double size = edge_;
    if (fine_.empty()) return size;
    grid_.for_each_near(point, point, (1 - kFinest) / kGrading * edge_,
                        [&](int i) { size = std::min(size, fine_[i].size + kGrading * norm(point - fine_[i].point)); });
    return size;
  }

 private:
  struct Fine {
    Vec2 point;
    double size;
  };
  double edge_;
  Grid grid_;
  std::vector<Fine> fine_;
};

enum class Density { even_out, thin_out };  // take out and put in, or only take out

class Relaxation {
 public:
  Relaxation(const Frame& frame, const OutlineCurve& outline, double edge, Random& random)
      : frame_(frame),
        outline_(outline),
        edge_(edge),
        n_frame_(static_cast<int>(frame.points_um.size())),
        size_(frame, edge),
        points_(frame.points_um),
        slide_(frame.outline_s_um) {
    add_seeds(random);
  }

  RelaxedMesh run() {
    RelaxedMesh mesh;
    renew();
    mesh.report.reason = "steps used up";
    for (int step = 1; step <= kMaxSteps; ++step) {
      mesh.report.iterations = step;
      mesh.report.last_change = move() / edge_;
      if (step % kDensityInterval == 0 && step <= kLastDensityStep) {
        renew();
        if (change_density(Density::even_out)) renew();
        continue;
      }
      if (moved_since_renewal() > kRenew * edge_) renew();
      if (mesh.report.last_change < kRest && step > kLastDensityStep) {
        mesh.report.converged = true;
        mesh.report.reason = "at rest";
        break;
      }
    }
    thin_out();
    mesh.points_um = std::move(points_);
    mesh.triangulation = std::move(mesh_);
    return mesh;
  }

 private:
  /// A regular triangular lattice, turned, shifted and jittered at random, where the frame leaves room.
  void add_seeds(Random& random) {
    Grid grid(frame_.points_um, edge_);
    for (int k = 0; k < static_cast<int>(frame_.segments.size()); ++k) {
      const FrameSegment& s = frame_.segments[k];
      grid.add(k, frame_.points_um[s.vertex_a], frame_.points_um[s.vertex_b]);
    }
    Grid alone(frame_.points_um, edge_);
    for (int v = 0; v < n_frame_; ++v) alone.add(v, frame_.points_um[v], frame_.points_um[v]);
    Vec2 low = frame_.points_um.front();
    Vec2 high = low;
    for (const Vec2 p : frame_.points_um) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    const Vec2 middle = 0.5 * (low + high);
    const double angle = random.uniform(0, std::numbers::pi / 3);
    const Vec2 along = kSpacing * edge_ * Vec2{std::cos(angle), std::sin(angle)};
    const Vec2 up =
        kSpacing * edge_ * Vec2{std::cos(angle + std::numbers::pi / 3), std::sin(angle + std::numbers::pi / 3)};
    const Vec2 origin = middle + random.uniform() * along + random.uniform() * up;
    const int reach = static_cast<int>(norm(high - low) / edge_) + 2;  // of the half diagonal, times 2/sqrt(3)
    for (int j = -reach; j <= reach; ++j) {
      for (int i = -reach; i <= reach; ++i) {
        const Vec2 jitter = kJitter * edge_ * Vec2{random.uniform(-1, 1), random.uniform(-1, 1)};
        const Vec2 p = origin + static_cast<double>(i) * along + static_cast<double>(j) * up + jitter;
        if (p.x < low.x || p.y < low.y || p.x > high.x || p.y > high.y) continue;
        const double clearance = kClearance * size_.at(p);
        bool is_clear = true;
        grid.for_each_near(p, p, clearance, [&](int k) {
          const FrameSegment& s = frame_.segments[k];
          is_clear = is_clear &&
                     distance_to_segment_um(p, frame_.points_um[s.vertex_a], frame_.points_um[s.vertex_b]) > clearance;
        });
        alone.for_each_near(p, p, clearance,
                            [&](int v) { is_clear = is_clear && norm(frame_.points_um[v] - p) > clearance; });
        if (is_clear) points_.push_back(p);
      }
    }
  }

  /// What still crowds at the end gives way, and its neighbours settle.
  void thin_out() {
    constexpr int kPasses = 4;
    constexpr int kSettlingSteps = 8;
    renew();
    for (int pass = 0; pass < kPasses && change_density(Density::thin_out); ++pass) {
      for (int step = 0; step < kSettlingSteps; ++step) {
        renew();
        move();
      }
      renew();
    }
    renew();
    for (int pass = 0; pass < kPasses && change_density(Density::thin_out); ++pass) renew();
  }

  /// Triangulate anew and leave out the free vertices that are outside the cell.
  void renew() {
    auto mesh = triangulate(points_, frame_.segments);
    if (!mesh) {
      // sliding has made the outline cross a fibre or itself: back to where it did not, and no more sliding
      if (renewed_at_.empty() || !is_sliding_) {
        throw InvalidData("outline and fibres", "lines that a mesh of this edge length can follow",
                          "lines that cross again and again");
      }
      is_sliding_ = false;
      for (int v = 0; v < n_frame_; ++v) points_[v] = frame_.points_um[v];
      mesh = triangulate(points_, frame_.segments);
      if (!mesh) {
        throw InvalidData("outline and fibres", "lines that a mesh of this edge length can follow", "lines that cross");
      }
    }
    mesh_ = std::move(*mesh);
    std::vector<char> is_inside(points_.size(), 0);
    for (const auto& t : mesh_.triangles) {
      for (const int v : t) is_inside[v] = 1;
    }
    std::vector<char> is_kept(points_.size(), 1);
    bool has_left = false;
    for (std::size_t v = n_frame_; v < points_.size(); ++v) {
      is_kept[v] = is_inside[v];
      has_left = has_left || !is_inside[v];
    }
    if (has_left) keep(is_kept);
    renewed_at_ = points_;
    vertex_size_.resize(points_.size());
    for (std::size_t v = 0; v < points_.size(); ++v) vertex_size_[v] = size_.at(points_[v]);
  }

  /// Leave out free vertices that no triangle of the present mesh uses.
  void keep(const std::vector<char>& is_kept) {
    std::vector<int> number(points_.size(), -1);
    std::vector<Vec2> kept;
    for (std::size_t v = 0; v < points_.size(); ++v) {
      if (!is_kept[v]) continue;
      number[v] = static_cast<int>(kept.size());
      kept.push_back(points_[v]);
    }
    points_ = std::move(kept);
    for (auto& t : mesh_.triangles) {
      for (int& v : t) v = number[v];
    }
    for (auto& e : mesh_.edges) {
      e.vertex_a = number[e.vertex_a];
      e.vertex_b = number[e.vertex_b];
      for (int& v : e.apexes) v = v < 0 ? v : number[v];
    }
  }

  /// One step along the forces. @return the furthest move
  double move() {
    std::vector<double> wanted(mesh_.edges.size());
    double squares = 0;
    double wanted_squares = 0;
    for (std::size_t k = 0; k < mesh_.edges.size(); ++k) {
      const auto& e = mesh_.edges[k];
      wanted[k] = 0.5 * (vertex_size_[e.vertex_a] + vertex_size_[e.vertex_b]);
      const Vec2 gap = points_[e.vertex_b] - points_[e.vertex_a];
      squares += dot(gap, gap);
      wanted_squares += wanted[k] * wanted[k];
    }
    const double scale = kOverlength * std::sqrt(squares / wanted_squares);
    forces_.assign(points_.size(), {});
    for (std::size_t k = 0; k < mesh_.edges.size(); ++k) {
      const auto& e = mesh_.edges[k];
      const Vec2 gap = points_[e.vertex_b] - points_[e.vertex_a];
      const double length = norm(gap);
      const double push = scale * wanted[k] - length;
      if (push > 0 && length > 0) {
        forces_[e.vertex_a] += (-push / length) * gap;
        forces_[e.vertex_b] += (push / length) * gap;
      }
      if (e.is_of_frame && length > 0) push_off_wall(e, (1 / length) * Vec2{-gap.y, gap.x}, wanted[k]);
    }
    double furthest = 0;
    for (std::size_t v = 0; v < points_.size(); ++v) {
      if (static_cast<int>(v) < n_frame_) {
        if (is_sliding_ && frame_.slides(static_cast<int>(v))) slide(static_cast<int>(v));
        continue;
      }
      const double length = norm(forces_[v]);
      const double most = kRenew * edge_ / kStep;
      const Vec2 shift = (length > most ? kStep * most / length : kStep) * forces_[v];
      points_[v] += shift;
      furthest = std::max(furthest, norm(shift));
    }
    return furthest;
  }

  void push_off_wall(const Triangulation::Edge& edge, Vec2 normal, double wanted) {
    for (const int apex : edge.apexes) {
      if (apex < n_frame_) continue;
      const double height = dot(points_[apex] - points_[edge.vertex_a], normal);
      const double push = kWall * wanted - std::abs(height);
      if (push > 0) forces_[apex] += (height < 0 ? -push : push) * normal;
    }
  }

  void slide(int v) {
    const double reach = 0.1 * edge_;
    const Vec2 chord = outline_.at(slide_[v] + reach) - outline_.at(slide_[v] - reach);
    const double length = norm(chord);
    if (length == 0) return;
    const double along = std::clamp(kStep * dot(forces_[v], chord) / length, -reach, reach);
    slide_[v] = outline_.wrapped(slide_[v] + along);
    points_[v] = outline_.at(slide_[v]);
  }

  double moved_since_renewal() const {
    double furthest = 0;
    for (std::size_t v = 0; v < points_.size(); ++v) furthest = std::max(furthest, norm(points_[v] - renewed_at_[v]));
    return furthest;
  }

  /// Take out free vertices that crowd, put some into long edges; neighbours of a change wait for the next time.
  bool change_density(Density density) {
    std::vector<int> order(mesh_.edges.size());
    std::iota(order.begin(), order.end(), 0);
    std::vector<double> relative(mesh_.edges.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      const auto& e = mesh_.edges[k];
      relative[k] =
          2 * norm(points_[e.vertex_b] - points_[e.vertex_a]) / (vertex_size_[e.vertex_a] + vertex_size_[e.vertex_b]);
    }
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return relative[a] < relative[b]; });
    std::vector<char> is_touched(points_.size(), 0);
    std::vector<char> is_kept(points_.size(), 1);
    std::vector<Vec2> added;
    const auto is_untouched = [&](const Triangulation::Edge& e) {
      return !is_touched[e.vertex_a] && !is_touched[e.vertex_b];
    };
    bool has_changed = false;
    for (const int k : order) {
      const auto& e = mesh_.edges[k];
      if (relative[k] > kTooShort) break;
      const int free = std::max(e.vertex_a, e.vertex_b);  // the frame's vertices come first
      if (free < n_frame_ || !is_untouched(e)) continue;
      is_kept[free] = 0;
      is_touched[e.vertex_a] = is_touched[e.vertex_b] = 1;
      has_changed = true;
    }
    for (auto k = order.rbegin(); density == Density::even_out && k != order.rend() && relative[*k] > kTooLong; ++k) {
      const auto& e = mesh_.edges[*k];
      if (e.is_of_frame || !is_untouched(e)) continue;
      added.push_back(0.5 * (points_[e.vertex_a] + points_[e.vertex_b]));
      is_touched[e.vertex_a] = is_touched[e.vertex_b] = 1;
      for (const int apex : e.apexes) {
        if (apex >= 0) is_touched[apex] = 1;
      }
      has_changed = true;
    }
    if (!has_changed) return false;
    std::vector<Vec2> kept;
    for (std::size_t v = 0; v < points_.size(); ++v) {
      if (is_kept[v]) kept.push_back(points_[v]);
    }
    points_ = std::move(kept);
    points_.insert(points_.end(), added.begin(), added.end());
    return true;
  }

  const Frame& frame_;
  const OutlineCurve& outline_;
  double edge_;
  int n_frame_;
  Size size_;
  std::vector<Vec2> points_;
  std::vector<double> slide_;  ///< arc length of the sliding vertices
  bool is_sliding_ = true;
  Triangulation mesh_;
  std::vector<Vec2> renewed_at_;
  std::vector<double> vertex_size_;
  std::vector<Vec2> forces_;
};

}  // namespace

RelaxedMesh fill_and_relax(const Frame& frame, const OutlineCurve& outline, double edge_um, Random& random) {
  return Relaxation(frame, outline, edge_um, random).run();
}

}  // namespace mbtfm::network
