#include "network/mesh/frame.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "network/mesh/adhesions.h"
#include "network/mesh/planar.h"
#include "network/mesh/polyline.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/polyline.h"
#include "pipeline/numerics/memory.h"
#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::mesh {
namespace {

// All in edge lengths. What is closer together than kMerge becomes one, and moves by no more: the width of a fibre
// is 0.4 edges. A vertex nearer to the outline than kBind lies on it, lest needle triangles fill the gap.
constexpr double kMerge = 0.1;
constexpr double kBind = 0.25;
constexpr double kFlat = 0.05;          // a fibre's points are left out where the line moves by less
constexpr double kShortestPiece = 0.4;  // of a fibre, between its own points
constexpr double kSnapReach = 1.0;      // an adhesion this far outside still belongs to the cell
constexpr double kBoundaryJitter = 0.15;
constexpr double kEdgeGrowth = 0.3;  // per length: triangles keep a quality of 0.95

std::string shown(double value_um) { return std::to_string(value_um) + " um"; }

/// A vertex of the graph that a ring of the boundary goes through.
struct Knot {
  double s_um = 0;
  int vertex = 0;
  Vec2 offset_um;  ///< of the vertex from the ring, where the ring reaches out to it
  bool operator<(const Knot& other) const { return std::pair(s_um, vertex) < std::pair(other.s_um, other.vertex); }
};

/// How far a ring that reaches out to a knot is drawn along at an arc length `gap_um` from it.
Vec2 drawn_along(const Knot& knot, double gap_um) {
  constexpr double kSlope = 1.5;  // of base to height: no needles
  const double reach = kSlope * norm(knot.offset_um);
  return reach > gap_um ? (1 - gap_um / reach) * knot.offset_um : Vec2{};
}

class Builder {
 public:
  Builder(const Cell& cell, const Boundary& boundary, const NetworkParameters& parameters, Random& random)
      : cell_(cell),
        boundary_(boundary),
        parameters_(parameters),
        edge_(parameters.edge_length_um),
        random_(random),
        frame_{.size = SizeField(edge_, kEdgeGrowth, cell.outline_um)} {}

  Frame build() {
    if (has_rims()) refine_at_rims();
    expect_room_for_mesh(frame_.size, boundary_);
    add_adhesions();
    for (const Fibre& fibre : cell_.fibres) add_fibre(fibre);
    if (has_rims()) add_rims();
    make_planar(graph_, frame_.size, kMerge);
    divide_evenly(graph_, frame_.size);
    make_planar(graph_, frame_.size, kMerge);
    const std::vector<std::vector<Knot>> knots = boundary_knots();
    for (std::size_t ring = 0; ring < knots.size(); ++ring) add_ring(static_cast<int>(ring), knots[ring]);
    make_planar(graph_, frame_.size, kMerge);  // what still crosses is found when the mesh is made
    collect();
    return std::move(frame_);
  }

 private:
  bool has_rims() const { return parameters_.adhesion_anchor == AdhesionAnchor::rim; }

  double rim_edge_um(const Adhesion& adhesion) const {
    return std::min(edge_, perimeter_um(adhesion) / parameters_.rim_points);
  }

  void refine_at_rims() {
    for (const Adhesion& a : cell_.adhesions) {
      const Polygon rim = rim_um(a, rim_edge_um(a));
      for (std::size_t i = 0; i < rim.size(); i += 2) frame_.size.refine(rim[i], rim_edge_um(a));
    }
  }

  void add_adhesions() {
    std::tie(adhesions_, frame_.separated_adhesion_ids) = separated(cell_.adhesions, frame_.size, 2 * kMerge);
    for (const Adhesion& a : adhesions_) {
      const BoundaryPlace place = boundary_.place(a.position_um);
      if (!place.is_inside && place.distance_um > kSnapReach * edge_) {
        throw InvalidData("adhesion " + std::to_string(a.adhesion_id),
                          "a place inside the outline or within one edge length (" + shown(edge_) + ") of it",
                          "it " + shown(place.distance_um) + (place.is_in_hole ? " inside a hole" : " outside"));
      }
      if (!place.is_inside) frame_.snapped_adhesion_ids.push_back(a.adhesion_id);
      vertex_of_adhesion_[a.adhesion_id] = graph_.add_vertex(a.position_um, kHeld);
      adhesion_of_vertex_[vertex_of_adhesion_[a.adhesion_id]] = &a;
    }
    std::sort(frame_.snapped_adhesion_ids.begin(), frame_.snapped_adhesion_ids.end());
  }

  void add_rims() {
    std::vector<Vec2> positions;
    double longest = 0;
    for (const Adhesion& a : adhesions_) {
      positions.push_back(a.position_um);
      longest = std::max(longest, a.major_axis_um);
    }
    numerics::Grid grid(positions, longest);
    for (int i = 0; i < static_cast<int>(positions.size()); ++i) grid.add(i, positions[i], positions[i]);
    for (const Adhesion& a : adhesions_) {
      std::vector<Adhesion> others;
      grid.for_each_near(a.position_um, a.position_um, longest, [&](int i) {
        if (adhesions_[i].adhesion_id != a.adhesion_id) others.push_back(adhesions_[i]);
      });
      for (const RimPart& part : free_rim(a, others, boundary_, rim_edge_um(a))) {
        Chain chain{.adhesion_id = a.adhesion_id, .is_closed = part.is_closed};
        for (const Vec2 p : part.points_um) chain.vertices.push_back(graph_.add_vertex(p, kRimPoint));
        graph_.chains.push_back(std::move(chain));
      }
    }
  }

  /// Within the outline, holes included: a fibre spans these.
  bool may_hold(Vec2 point, const Fibre& fibre) const {
    if (boundary_.is_within_outline(point) || boundary_.place(point).distance_um < kBind * edge_) return true;
    for (const auto& end : {fibre.start_adhesion_id, fibre.end_adhesion_id})
      if (end && norm(point - graph_.points_um[vertex_of_adhesion_.at(*end)]) < kSnapReach * edge_) return true;
    return false;
  }

  void add_fibre(const Fibre& fibre) {
    const Polyline dense = densified(fibre.points_um, kBind * edge_);
    const int n = static_cast<int>(dense.size());
    bool is_clipped =
        (!fibre.start_adhesion_id && is_in_hole(dense.front())) || (!fibre.end_adhesion_id && is_in_hole(dense.back()));
    bool has_part = false;
    for (int first = 0; first < n;) {
      if (!may_hold(dense[first], fibre)) {
        is_clipped = true;
        ++first;
        continue;
      }
      int last = first;
      while (last + 1 < n && may_hold(dense[last + 1], fibre)) ++last;
      // an end made by clipping lies on the outline, not in the margin that a fibre along it is allowed
      int from = first;
      int to = last;
      while (first > 0 && from < to && !boundary_.is_within_outline(dense[from])) ++from;
      while (last < n - 1 && from < to && !boundary_.is_within_outline(dense[to])) --to;
      Polyline part(dense.begin() + from, dense.begin() + to + 1);
      if (first > 0 && from > 0) part.insert(part.begin(), crossing_of_outline(dense[from], dense[from - 1]));
      if (last < n - 1 && to < n - 1) part.push_back(crossing_of_outline(dense[to], dense[to + 1]));
      if (length_um(part) > kShortestPiece * edge_)
        has_part = add_fibre_part(fibre, part, first == 0, last == n - 1) || has_part;
      first = last + 1;
    }
    if (!has_part) {
      throw InvalidData("fibre " + std::to_string(fibre.fibre_id),
                        "a part longer than " + shown(kShortestPiece * edge_) + " inside the outline", "none");
    }
    if (is_clipped) frame_.clipped_fibre_ids.push_back(fibre.fibre_id);
  }

  /// Where the line from a point inside the outline to the next, outside, leaves it.
  Vec2 crossing_of_outline(Vec2 inside, Vec2 outside) const {
    constexpr int kBisections = 30;
    for (int i = 0; i < kBisections; ++i) {
      const Vec2 middle = 0.5 * (inside + outside);
      (boundary_.is_within_outline(middle) ? inside : outside) = middle;
    }
    return inside;
  }

  /// Let an end run into the centre of its adhesion: points in its ellipse or near its centre give way.
  static void end_on(Polyline& line, const Adhesion& adhesion, double near_um) {
    const Vec2 centre = adhesion.position_um;
    while (line.size() > 1 && (norm(line.back() - centre) < near_um || covers(adhesion, line.back()))) line.pop_back();
    line.push_back(centre);
  }

  bool add_fibre_part(const Fibre& fibre, Polyline line, bool has_start, bool has_end) {
    const int before = has_start && fibre.start_adhesion_id ? vertex_of_adhesion_.at(*fibre.start_adhesion_id) : -1;
    const int after = has_end && fibre.end_adhesion_id ? vertex_of_adhesion_.at(*fibre.end_adhesion_id) : -1;
    const double near_um = kShortestPiece * edge_;
    if (after >= 0) end_on(line, *adhesion_of_vertex_.at(after), near_um);
    if (before >= 0) {
      std::reverse(line.begin(), line.end());
      end_on(line, *adhesion_of_vertex_.at(before), near_um);
      std::reverse(line.begin(), line.end());
    }
    line = without_short_pieces(simplified(line, kFlat * edge_), near_um);
    if (length_um(line) <= kMerge * edge_) return false;
    const auto vertex = [&](std::size_t i) {
      if (i == 0 && before >= 0) return before;
      if (i + 1 == line.size() && after >= 0) return after;
      return graph_.add_vertex(line[i], i == 0 || i + 1 == line.size() ? kFibreEnd : kFibrePoint);
    };
    std::vector<Chain> pieces = {{.fibre_id = fibre.fibre_id, .vertices = {vertex(0)}}};
    for (std::size_t i = 1; i < line.size(); ++i) {
      for (const Vec2 crossing : crossings_of_holes(line[i - 1], line[i])) {
        const int v = graph_.add_vertex(crossing, kFibreEnd);
        pieces.back().vertices.push_back(v);
        pieces.push_back({.fibre_id = fibre.fibre_id, .vertices = {v}});
      }
      pieces.back().vertices.push_back(vertex(i));
    }
    // nothing holds an end that is free in a hole: cut it off
    if (after < 0 && is_in_hole(line.back())) pieces.pop_back();
    if (before < 0 && !pieces.empty() && is_in_hole(line.front())) pieces.erase(pieces.begin());
    graph_.chains.insert(graph_.chains.end(), pieces.begin(), pieces.end());
    return !pieces.empty();
  }

  bool is_in_hole(Vec2 point) const { return boundary_.place(point).is_in_hole; }

  /// Where the line from a to b enters or leaves a hole, in its order.
  Polyline crossings_of_holes(Vec2 a, Vec2 b) const {
    std::vector<double> shares;
    for (std::size_t ring = 1; ring < boundary_.rings().size(); ++ring) {
      const Polygon& corners = boundary_.rings()[ring].polygon();
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec2 c = corners[i];
        const Vec2 d = corners[(i + 1) % corners.size()];
        const double determinant = cross(b - a, d - c);
        if (determinant == 0) continue;
        const double along = cross(c - a, d - c) / determinant;
        const double along_ring = cross(c - a, b - a) / determinant;
        if (along > 0 && along < 1 && along_ring >= 0 && along_ring < 1) shares.push_back(along);
      }
    }
    std::sort(shares.begin(), shares.end());
    Polyline crossings;
    for (const double share : shares) crossings.push_back(a + share * (b - a));
    return crossings;
  }

  /// By ring: the vertices near it, and those outside the cell that the mesh reaches out to.
  std::vector<std::vector<Knot>> boundary_knots() const {
    std::vector<std::vector<Knot>> knots(boundary_.rings().size());
    std::vector<char> is_used(graph_.points_um.size(), 0);
    for (const Chain& chain : graph_.chains)
      for (const int v : chain.vertices) is_used[v] = 1;
    for (const auto& [id, v] : vertex_of_adhesion_) is_used[v] = 1;
    for (int v = 0; v < static_cast<int>(is_used.size()); ++v) {
      if (!is_used[v]) continue;
      const BoundaryPlace place = boundary_.place(graph_.points_um[v]);
      const bool is_near = place.distance_um < kBind * frame_.size.at(graph_.points_um[v]);
      const bool is_reached_out_to = !place.is_inside && (!place.is_in_hole || graph_.rank[v] == kHeld);
      if (!is_near && !is_reached_out_to) continue;
      const Vec2 offset = graph_.points_um[v] - boundary_.rings()[place.ring].at(place.s_um);
      knots[place.ring].push_back({place.s_um, v, is_near ? Vec2{} : offset});
    }
    return knots;
  }

  /// A ring through its knots and corners, evenly divided in between.
  void add_ring(int ring, std::vector<Knot> knots) {
    const OutlineCurve& curve = boundary_.rings()[ring];
    const auto n_bound = static_cast<std::ptrdiff_t>(knots.size());
    for (const double s : curve.corners()) {
      const double clearance = kShortestPiece * frame_.size.at(curve.at(s));
      const bool is_free = std::none_of(knots.begin(), knots.begin() + n_bound, [&](const Knot& knot) {
        const double gap = std::abs(knot.s_um - s);
        return std::min(gap, curve.length_um() - gap) < clearance;
      });
      if (is_free) knots.push_back({s, graph_.add_vertex(curve.at(s), kFibrePoint), {}});
    }
    if (knots.empty()) {
      const double s = curve.length_um() * random_.uniform();
      knots.push_back({s, sliding_vertex(ring, s), {}});
    }
    std::sort(knots.begin(), knots.end());
    const int fewest = knots.size() == 1 ? 6 : knots.size() == 2 ? 2 : 1;  // a closed line needs three vertices
    Chain chain{.is_closed = true};
    for (std::size_t i = 0; i < knots.size(); ++i) {
      const Knot& knot = knots[i];
      const Knot& next = knots[(i + 1) % knots.size()];
      chain.vertices.push_back(knot.vertex);
      const double arc = next.s_um - knot.s_um + (i + 1 == knots.size() ? curve.length_um() : 0);
      const auto size_at = [&](double along) { return frame_.size.at(curve.at(knot.s_um + along)); };
      for (double along : even_division_um(arc, size_at, fewest)) {
        along += random_.uniform(-kBoundaryJitter, kBoundaryJitter) * std::min(size_at(along), arc / fewest);
        const Vec2 drawn = drawn_along(knot, along) + drawn_along(next, arc - along);
        const double s = knot.s_um + along;
        chain.vertices.push_back(drawn == Vec2{} ? sliding_vertex(ring, s)
                                                 : graph_.add_vertex(curve.at(s) + drawn, kOutlinePoint));
      }
    }
    graph_.chains.push_back(std::move(chain));
  }

  int sliding_vertex(int ring, double s) {
    const OutlineCurve& curve = boundary_.rings()[ring];
    const int v = graph_.add_vertex(curve.at(s), kOutlinePoint);
    slides_at_[v] = {ring, curve.wrapped(s)};
    return v;
  }

  int numbered(int v) {
    number_.resize(graph_.points_um.size(), -1);
    if (number_[v] >= 0) return number_[v];
    number_[v] = static_cast<int>(frame_.points_um.size());
    frame_.points_um.push_back(graph_.points_um[v]);
    const auto adhesion = adhesion_of_vertex_.find(v);
    frame_.adhesion_id.push_back(adhesion == adhesion_of_vertex_.end() ? 0 : adhesion->second->adhesion_id);
    frame_.rim_adhesion_id.push_back(0);
    const auto slide = slides_at_.find(v);
    frame_.ring.push_back(slide == slides_at_.end() ? -1 : slide->second.first);
    frame_.ring_s_um.push_back(slide == slides_at_.end() ? 0 : slide->second.second);
    return number_[v];
  }

  /// Number the vertices that are on a chain or held, and gather what runs along each segment.
  void collect() {
    for (const auto& [id, v] : vertex_of_adhesion_) numbered(v);
    std::map<std::pair<int, int>, FrameSegment> segments;
    for (const Chain& chain : graph_.chains) {
      const std::size_t n = chain.vertices.size();
      for (std::size_t i = 0; i < (chain.is_closed ? n : n - 1); ++i) {
        const int first = numbered(chain.vertices[i]);
        const int second = numbered(chain.vertices[(i + 1) % n]);
        const auto [a, b] = std::minmax(first, second);
        FrameSegment& segment = segments[{a, b}];
        segment.vertex_a = a;
        segment.vertex_b = b;
        if (chain.fibre_id > 0)
          segment.fibre_ids.push_back(chain.fibre_id);
        else if (chain.adhesion_id > 0)
          frame_.rim_adhesion_id[a] = frame_.rim_adhesion_id[b] = chain.adhesion_id;
        else
          ++segment.outline_count;
      }
    }
    std::vector<int> degree(frame_.points_um.size(), 0);
    for (auto& [ends, segment] : segments) {
      std::vector<int>& ids = segment.fibre_ids;
      std::sort(ids.begin(), ids.end());
      ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
      frame_.segments.push_back(segment);
      frame_.n_shared_segments += ids.size() > 1;
      ++degree[segment.vertex_a];
      ++degree[segment.vertex_b];
      if (ids.empty() && segment.outline_count == 1) continue;
      for (const int v : {segment.vertex_a, segment.vertex_b}) frame_.ring[v] = -1;
    }
    for (std::size_t v = 0; v < degree.size(); ++v)
      if (degree[v] != 2) frame_.ring[v] = -1;
  }

  const Cell& cell_;
  const Boundary& boundary_;
  const NetworkParameters& parameters_;
  double edge_;
  Random& random_;
  std::vector<Adhesion> adhesions_;  ///< moved apart
  PlanarGraph graph_;
  std::map<int, int> vertex_of_adhesion_;
  std::map<int, const Adhesion*> adhesion_of_vertex_;
  std::map<int, std::pair<int, double>> slides_at_;  ///< ring and arc length
  std::vector<int> number_;                          ///< in the frame, by vertex of the graph
  Frame frame_;
};

}  // namespace

double area_of_vertex_um2(double edge_um) { return 0.5 * std::numbers::sqrt3 * edge_um * edge_um; }

void expect_room_for_vertices(double count) {
  constexpr double kBytes = 1000;  // measured: 1.2 kB of 35 000, 1.0 of 316 000
  numerics::expect_room_for({.what = "the network's mesh",
                             .count = count,
                             .parts = "vertices",
                             .bytes_each = kBytes,
                             .remedy = "choose a larger edge_length_um (a cell usually has some thousand vertices)"});
}

void expect_room_for_mesh(const SizeField& size, const Boundary& boundary) {
  const Polygon& outline = boundary.rings().front().polygon();
  const auto [low, high] = extent_of(outline);
  // the integral of the vertices' density, by its values at the centres of squares
  constexpr double kSquares = 1e4;
  const double step = std::sqrt((high.x - low.x) * (high.y - low.y) / kSquares);
  double count = 0;
  for (double y = low.y + 0.5 * step; y < high.y; y += step) {
    for (double x = low.x + 0.5 * step; x < high.x; x += step)
      if (boundary.is_within_outline({x, y})) count += step * step / area_of_vertex_um2(size.at({x, y}));
  }
  expect_room_for_vertices(count);
}

Frame build_frame(const Cell& cell, const Boundary& boundary, const NetworkParameters& parameters, Random& random) {
  return Builder(cell, boundary, parameters, random).build();
}

}  // namespace mbtfm::mesh
