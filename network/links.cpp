#include "network/links.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace mbtfm::network {
namespace {

using Edge = Triangulation::Edge;

// Of the network's material, what the links to second neighbours stand for where there are all of them. With half of
// it each of the twelve directions of a regular triangulation has the same.
constexpr double kReachingPart = 0.5;
constexpr double kSmallestShare = 0.02;  // of an edge across from an obtuse angle: a cable cannot push

class Linking {
 public:
  Linking(const Frame& frame, const RelaxedMesh& mesh, const NetworkParameters& parameters)
      : frame_(frame),
        points_(mesh.points_um),
        edges_(mesh.triangulation.edges),
        has_even_tension_(parameters.link_weights == "width"),
        // in a regular triangulation an edge of length h has the dual width h / sqrt(3)
        regular_width_um_(parameters.edge_length_um / std::sqrt(3.0)) {
    if (parameters.link_reach == "neighbours") return;
    for (const Edge& e : edges_) {
      if (!reaches_across(e)) continue;
      for (const int apex : e.apexes) ++n_reaching_[triangle(e, apex)];
    }
  }

  std::vector<Link> links() const {
    std::map<std::pair<int, int>, const FrameSegment*> fibres;
    for (const FrameSegment& s : frame_.segments) {
      if (!s.fibre_ids.empty()) fibres[{s.vertex_a, s.vertex_b}] = &s;
    }
    std::vector<Link> links;
    for (const Edge& e : edges_) {
      const auto segment = fibres.find({e.vertex_a, e.vertex_b});
      if (segment == fibres.end()) {
        links.push_back(link(e.vertex_a, e.vertex_b, 0, near_share(e)));
      } else {
        for (const int id : segment->second->fibre_ids) links.push_back(link(e.vertex_a, e.vertex_b, id, 1));
        fibres.erase(segment);
      }
      if (!n_reaching_.empty() && reaches_across(e)) {
        links.push_back(link(e.apexes[1], e.apexes[0], 0, reaching_share(e)));
      }
    }
    // a fibre in a neck so thin that no triangle is left there
    for (const auto& [ends, segment] : fibres) {
      for (const int id : segment->fibre_ids) links.push_back(link(ends.first, ends.second, id, 1));
    }
    return links;
  }

 private:
  static std::array<int, 3> triangle(const Edge& e, int apex) {
    std::array<int, 3> corners = {e.vertex_a, e.vertex_b, apex};
    std::sort(corners.begin(), corners.end());
    return corners;
  }

  Link link(int a, int b, int fibre_id, double share) const {
    return {.vertex_a = std::min(a, b),
            .vertex_b = std::max(a, b),
            .fibre_id = fibre_id,
            .rest_length_um = norm(points_[b] - points_[a]),
            .share = share};
  }

  /// A straight cable between the apexes crosses the edge, and nothing else.
  bool reaches_across(const Edge& e) const {
    if (e.is_of_frame || e.apexes[0] < 0 || e.apexes[1] < 0) return false;
    const Vec2 c = points_[e.apexes[0]];
    const Vec2 along = points_[e.apexes[1]] - c;
    return cross(along, points_[e.vertex_a] - c) * cross(along, points_[e.vertex_b] - c) < 0;
  }

  /// Of the material of a triangle, what its edges stand for.
  double near_part(const Edge& e, int apex) const {
    const auto found = n_reaching_.find(triangle(e, apex));
    return found == n_reaching_.end() ? 1 : 1 - kReachingPart * found->second / 3;
  }

  /// Width of material that an edge stands for: its length between the circumcentres of its two triangles. With a
  /// tension in proportion to it, the links pull as a sheet of even surface tension does, on any triangulation:
  /// t_ab = sigma (cot alpha + cot beta) l_ab / 2 is minus the gradient of the sheet's area. A triangle that is obtuse
  /// there would count negative.
  /// Source: Pinkall & Polthier, Exp. Math. 2:15 (1993), eq. 2.
  double near_share(const Edge& e) const {
    const Vec2 a = points_[e.vertex_a], b = points_[e.vertex_b];
    double width_um = 0, parts = 0;
    int n_triangles = 0;
    for (const int apex : e.apexes) {
      if (apex < 0) continue;
      const double part = near_part(e, apex);
      const Vec2 to_a = a - points_[apex], to_b = b - points_[apex];
      const double doubled_area_um2 = std::abs(cross(to_a, to_b));
      if (doubled_area_um2 > 0) width_um += 0.5 * part * norm(b - a) * dot(to_a, to_b) / doubled_area_um2;
      parts += part;
      ++n_triangles;
    }
    if (!has_even_tension_) return n_triangles > 0 ? parts / n_triangles : 1;
    return std::max(kSmallestShare, width_um / regular_width_um_);
  }

  /// A triangle of area A gives a third of its reaching part to the link across each side. As the stress of links is
  /// half the sum of t l over the area in its trace, a link with A of both its triangles carries t l = 2 sigma A / 3 of
  /// that part.
  double reaching_share(const Edge& e) const {
    if (!has_even_tension_) return kReachingPart / std::sqrt(3.0);  // as in a regular triangulation
    const Vec2 along = points_[e.apexes[1]] - points_[e.apexes[0]];
    const double area_um2 = 0.5 * std::abs(cross(along, points_[e.vertex_b] - points_[e.vertex_a]));
    return 2 * kReachingPart * area_um2 / (3 * norm(along) * regular_width_um_);
  }

  const Frame& frame_;
  const std::vector<Vec2>& points_;
  const std::vector<Edge>& edges_;
  bool has_even_tension_;
  double regular_width_um_;
  std::map<std::array<int, 3>, int> n_reaching_;  ///< by triangle: links that leave it across a side
};

}  // namespace

std::vector<Link> links_of(const Frame& frame, const RelaxedMesh& mesh, const NetworkParameters& parameters) {
  return Linking(frame, mesh, parameters).links();
}

}  // namespace mbtfm::network
