#include "network/mesh/links.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace mbtfm::mesh {
namespace {

using Edge = Triangulation::Edge;

// Of its width an edge gives this part to the links across the quadrilaterals that it is a side of. On a regular
// triangulation each of the twelve directions then has the same.
constexpr double kGivenPart = 2.0 / 3;
constexpr double kSmallestShare = 0.02;  // of an edge across from an obtuse angle: a cable cannot push

/// Width of material that an edge represents: its length between the circumcentres of its two triangles. With a
/// tension in proportion to it, the links pull as a sheet of even surface tension does, on any triangulation:
/// t_ab = sigma (cot alpha + cot beta) l_ab / 2 is minus the gradient of the sheet's area. A triangle that is obtuse
/// there would count negative.
/// Source: Pinkall & Polthier, Exp. Math. 2:15 (1993), eq. 2.
double dual_width_um(const std::vector<Vec2>& points, const Edge& edge) {
  const Vec2 a = points[edge.vertex_a];
  const Vec2 b = points[edge.vertex_b];
  double cotangents = 0;
  for (const int apex : edge.apexes) {
    if (apex < 0) continue;
    const Vec2 to_a = a - points[apex];
    const Vec2 to_b = b - points[apex];
    const double doubled_area = std::abs(cross(to_a, to_b));
    if (doubled_area > 0) cotangents += dot(to_a, to_b) / doubled_area;
  }
  return 0.5 * cotangents * norm(b - a);
}

/// A link across an edge ab, between the apexes c and d of its triangles. Four points in the plane have one state of
/// self-stress: with a pull of 1 um⁻¹ times its length in cd, the sides of the quadrilateral take the pulls below, and
/// no point feels a force.
struct Reaching {
  int edge = 0;                      ///< that it crosses
  std::array<int, 4> sides{};        ///< edges ac, bc, ad, bd
  double of_edge = 0;                ///< pull over length of ab, in that of cd
  std::array<double, 4> of_sides{};  ///< of the sides, negative: they give way
  double length_um = 0;
};

class Shares {
 public:
  Shares(const RelaxedMesh& mesh, const NetworkParameters& parameters)
      : points_(mesh.points_um), edges_(mesh.triangulation.edges) {
    // in a regular triangulation an edge of length h has the dual width h / sqrt(3)
    const double regular_width = parameters.edge_length_um / std::sqrt(3.0);
    for (const Edge& e : edges_)
      of_edge_.push_back(parameters.link_weights == LinkWeights::width ? dual_width_um(points_, e) / regular_width : 1);
    of_reaching_.assign(edges_.size(), 0);
    if (parameters.link_reach == LinkReach::second_neighbours) hand_on();
    for (double& share : of_edge_) share = std::max(kSmallestShare, share);
  }

  double of_edge(std::size_t k) const { return of_edge_[k]; }
  /// Of the link across the edge; 0: there is none.
  double of_reaching(std::size_t k) const { return of_reaching_[k]; }

 private:
  int edge_of(int a, int b) const {
    const std::pair<int, int> ends = std::minmax(a, b);
    return static_cast<int>(std::lower_bound(edges_.begin(), edges_.end(), ends,
                                             [](const Edge& e, const std::pair<int, int>& sought) {
                                               return std::pair(e.vertex_a, e.vertex_b) < sought;
                                             }) -
                            edges_.begin());
  }

  /// The links whose straight cable crosses one edge along which nothing runs, and nothing else.
  std::vector<Reaching> reaching() const {
    std::vector<Reaching> result;
    for (int k = 0; k < static_cast<int>(edges_.size()); ++k) {
      const Edge& e = edges_[k];
      if (e.is_of_frame || e.apexes[0] < 0 || e.apexes[1] < 0) continue;
      const Vec2 a = points_[e.vertex_a], b = points_[e.vertex_b], c = points_[e.apexes[0]], d = points_[e.apexes[1]];
      const double acd = cross(c - a, d - a), bcd = cross(c - b, d - b);
      const double abc = std::abs(cross(b - a, c - a)), abd = std::abs(cross(b - a, d - a));
      if (!(acd * bcd < 0) || abc == 0 || abd == 0) continue;
      const double p = std::abs(acd), q = std::abs(bcd);
      result.push_back({.edge = k,
                        .sides = {edge_of(e.vertex_a, e.apexes[0]), edge_of(e.vertex_b, e.apexes[0]),
                                  edge_of(e.vertex_a, e.apexes[1]), edge_of(e.vertex_b, e.apexes[1])},
                        .of_edge = p * q / (abc * abd),
                        .of_sides = {-q / abc, -p / abc, -q / abd, -p / abd},
                        .length_um = norm(d - c)});
    }
    return result;
  }

  /// Superpose the states of self-stress, each as far as the sides that it takes from have something to give: the
  /// forces on the vertices stay what they are.
  void hand_on() {
    const std::vector<Reaching> links = reaching();
    std::vector<int> n_takers(edges_.size(), 0);
    for (const Reaching& r : links)
      for (const int side : r.sides) ++n_takers[side];
    std::vector<double> change(edges_.size(), 0);
    for (const Reaching& r : links) {
      double pull_per_um = std::numeric_limits<double>::infinity();
      for (int i = 0; i < 4; ++i) {
        const int side = r.sides[i];
        const double given = kGivenPart * std::max(0.0, of_edge_[side]) / n_takers[side];
        pull_per_um = std::min(pull_per_um, given / (-r.of_sides[i] * length_um(edges_[side])));
      }
      of_reaching_[r.edge] = pull_per_um * r.length_um;
      change[r.edge] += pull_per_um * r.of_edge * length_um(edges_[r.edge]);
      for (int i = 0; i < 4; ++i) change[r.sides[i]] += pull_per_um * r.of_sides[i] * length_um(edges_[r.sides[i]]);
    }
    for (std::size_t k = 0; k < change.size(); ++k) of_edge_[k] += change[k];
  }

  double length_um(const Edge& e) const { return norm(points_[e.vertex_b] - points_[e.vertex_a]); }

  const std::vector<Vec2>& points_;
  const std::vector<Edge>& edges_;
  std::vector<double> of_edge_, of_reaching_;
};

}  // namespace

std::vector<Link> links_of(const Frame& frame, const RelaxedMesh& mesh, const NetworkParameters& parameters) {
  std::map<std::pair<int, int>, const FrameSegment*> fibre_segments;
  for (const FrameSegment& s : frame.segments)
    if (!s.fibre_ids.empty()) fibre_segments[{s.vertex_a, s.vertex_b}] = &s;
  const Shares shares(mesh, parameters);
  std::vector<Link> links;
  const auto add = [&](int a, int b, int fibre_id, double share) {
    const auto [low, high] = std::minmax(a, b);
    const double length_um = norm(mesh.points_um[high] - mesh.points_um[low]);
    links.push_back({low, high, fibre_id, length_um, share});
  };
  for (std::size_t k = 0; k < mesh.triangulation.edges.size(); ++k) {
    const Edge& e = mesh.triangulation.edges[k];
    const auto segment = fibre_segments.find({e.vertex_a, e.vertex_b});
    if (segment == fibre_segments.end()) {
      add(e.vertex_a, e.vertex_b, 0, shares.of_edge(k));
    } else {
      for (const int id : segment->second->fibre_ids) add(e.vertex_a, e.vertex_b, id, 1);
      fibre_segments.erase(segment);
    }
    if (shares.of_reaching(k) > 0) add(e.apexes[0], e.apexes[1], 0, shares.of_reaching(k));
  }
  // a fibre in a neck so thin that no triangle is left there
  for (const auto& [ends, segment] : fibre_segments)
    for (const int id : segment->fibre_ids) add(ends.first, ends.second, id, 1);
  return links;
}

}  // namespace mbtfm::mesh
