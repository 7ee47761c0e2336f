#include "network/frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "network/planar.h"
#include "network/polyline.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::network {
namespace {

// All in edge lengths. What is closer together than kMerge becomes one, and moves by no more: the width of a fibre
// is 0.4 edges. A vertex nearer to the outline than kBind lies on it, lest needle triangles fill the gap.
constexpr double kMerge = 0.1;
constexpr double kBind = 0.25;
constexpr double kFlat = 0.05;          // a fibre's points are left out where the line moves by less
constexpr double kShortestPiece = 0.4;  // of a fibre, between its own points
constexpr double kSnapReach = 1.0;      // an adhesion this far outside still belongs to the cell
constexpr double kOutlineJitter = 0.15;

std::string shown(double value_um) { return std::to_string(value_um) + " um"; }

struct Place {
  double s_um = 0;
  double distance_um = 0;
  bool is_inside = true;
};

Place place_at(const OutlineCurve& outline, Vec2 point) {
  const double s = outline.nearest(point);
  return {s, norm(point - outline.at(s)), contains(outline.polygon(), point)};
}

/// Positions of the adhesions, those at the same place moved apart so that each can hold a vertex.
std::vector<Vec2> separated_positions(const std::vector<Adhesion>& adhesions, double distance,
                                      std::vector<int>& moved) {
  std::vector<Vec2> positions;
  for (const Adhesion& a : adhesions) positions.push_back(a.position_um);
  constexpr int kSweeps = 20;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    bool has_changed = false;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const Vec2 gap = positions[i] - positions[j];
        const double length = norm(gap);
        if (length >= distance) continue;
        const double angle = adhesions[j].angle_rad;  // along the one that came first, where there is no direction
        const Vec2 direction = length > 1e-6 * distance ? (1 / length) * gap : Vec2{std::cos(angle), std::sin(angle)};
        const Vec2 shift = (0.505 * (distance - length)) * direction;  // a little too far, so that it ends
        positions[i] += shift;
        positions[j] += -1.0 * shift;
        moved.push_back(adhesions[i].adhesion_id);
        moved.push_back(adhesions[j].adhesion_id);
        has_changed = true;
      }
    }
    if (!has_changed) break;
  }
  std::sort(moved.begin(), moved.end());
  moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
  return positions;
}

class Builder {
 public:
  Builder(const Cell& cell, const OutlineCurve& outline, double edge, Random& random)
      : cell_(cell), outline_(outline), edge_(edge), random_(random) {}

  Frame build() {
    add_adhesions();
    for (const Fibre& fibre : cell_.fibres) add_fibre(fibre);
    bool is_planar = make_planar(graph_, kMerge * edge_);
    subdivide_fibres(graph_, edge_);
    make_planar(graph_, kMerge * edge_);
    add_outline();
    is_planar = make_planar(graph_, kMerge * edge_) && is_planar;
    frame_.is_planar = is_planar;
    collect();
    return std::move(frame_);
  }

 private:
  void add_adhesions() {
    const auto positions = separated_positions(cell_.adhesions, 2 * kMerge * edge_, frame_.separated_adhesion_ids);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const int id = cell_.adhesions[i].adhesion_id;
      const Place place = place_at(outline_, positions[i]);
      if (!place.is_inside && place.distance_um > kSnapReach * edge_) {
        throw InvalidData("adhesion " + std::to_string(id),
                          "a place inside the outline or within one edge length (" + shown(edge_) + ") of it",
                          "it " + shown(place.distance_um) + " outside");
      }
      if (!place.is_inside) frame_.snapped_adhesion_ids.push_back(id);
      vertex_of_adhesion_[id] = graph_.add_vertex(positions[i], kHeld);
      adhesion_of_vertex_[vertex_of_adhesion_[id]] = &cell_.adhesions[i];
    }
    std::sort(frame_.snapped_adhesion_ids.begin(), frame_.snapped_adhesion_ids.end());
  }

  bool is_within_cell(Vec2 point, const Fibre& fibre) const {
    if (contains(outline_.polygon(), point) || place_at(outline_, point).distance_um < kBind * edge_) return true;
    for (const auto& end : {fibre.start_adhesion_id, fibre.end_adhesion_id}) {
      if (end && norm(point - graph_.points_um[vertex_of_adhesion_.at(*end)]) < kSnapReach * edge_) return true;
    }
    return false;
  }

  void add_fibre(const Fibre& fibre) {
    const Polyline dense = densified(fibre.points_um, kBind * edge_);
    const int n = static_cast<int>(dense.size());
    bool is_clipped = false;
    bool has_part = false;
    for (int first = 0; first < n;) {
      if (!is_within_cell(dense[first], fibre)) {
        is_clipped = true;
        ++first;
        continue;
      }
      int last = first;
      while (last + 1 < n && is_within_cell(dense[last + 1], fibre)) ++last;
      // an end made by clipping lies inside, not in the margin that a fibre along the outline is allowed
      int from = first;
      int to = last;
      while (first > 0 && from < to && !contains(outline_.polygon(), dense[from])) ++from;
      while (last < n - 1 && from < to && !contains(outline_.polygon(), dense[to])) --to;
      const Polyline part(dense.begin() + from, dense.begin() + to + 1);
      if (length_um(part) > kShortestPiece * edge_) {
        has_part = add_fibre_part(fibre, part, first == 0, last == n - 1) || has_part;
      }
      first = last + 1;
    }
    if (!has_part) {
      throw InvalidData("fibre " + std::to_string(fibre.fibre_id),
                        "a part longer than " + shown(kShortestPiece * edge_) + " inside the outline", "none");
    }
    if (is_clipped) frame_.clipped_fibre_ids.push_back(fibre.fibre_id);
  }

  /// Let an end run into the centre of its adhesion: points in its ellipse or near its centre give way.
  static void end_on(Polyline& line, const Adhesion& adhesion, Vec2 centre, double near_um) {
    while (line.size() > 1 && (norm(line.back() - centre) < near_um || covers(adhesion, line.back()))) line.pop_back();
    line.push_back(centre);
  }

  bool add_fibre_part(const Fibre& fibre, Polyline line, bool has_start, bool has_end) {
    const int before = has_start && fibre.start_adhesion_id ? vertex_of_adhesion_.at(*fibre.start_adhesion_id) : -1;
    const int after = has_end && fibre.end_adhesion_id ? vertex_of_adhesion_.at(*fibre.end_adhesion_id) : -1;
    const double near_um = kShortestPiece * edge_;
    if (after >= 0) end_on(line, *adhesion_of_vertex_.at(after), graph_.points_um[after], near_um);
    if (before >= 0) {
      std::reverse(line.begin(), line.end());
      end_on(line, *adhesion_of_vertex_.at(before), graph_.points_um[before], near_um);
      std::reverse(line.begin(), line.end());
    }
    line = without_short_pieces(simplified(line, kFlat * edge_), near_um);
    if (length_um(line) <= kMerge * edge_) return false;
    Chain chain;
    chain.fibre_id = fibre.fibre_id;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const bool is_front = i == 0;
      const bool is_back = i + 1 == line.size();
      if (is_front && before >= 0) {
        chain.vertices.push_back(before);
      } else if (is_back && after >= 0) {
        chain.vertices.push_back(after);
      } else {
        chain.vertices.push_back(graph_.add_vertex(line[i], is_front || is_back ? kFibreEnd : kFibrePoint));
      }
    }
    graph_.chains.push_back(std::move(chain));
    return true;
  }

  /// The outline through every vertex near it or outside it and through its corners, evenly divided in between.
  void add_outline() {
    std::vector<std::pair<double, int>> knots;  // arc length, vertex
    std::vector<char> is_used(graph_.points_um.size(), 0);
    for (const Chain& chain : graph_.chains) {
      for (const int v : chain.vertices) is_used[v] = 1;
    }
    for (const auto& [id, v] : vertex_of_adhesion_) is_used[v] = 1;
    for (int v = 0; v < static_cast<int>(is_used.size()); ++v) {
      if (!is_used[v]) continue;
      const Place place = place_at(outline_, graph_.points_um[v]);
      if (!place.is_inside || place.distance_um < kBind * edge_) knots.push_back({place.s_um, v});
    }
    const std::size_t n_bound = knots.size();
    for (const double s : outline_.corners()) {
      const bool is_free =
          std::none_of(knots.begin(), knots.begin() + static_cast<std::ptrdiff_t>(n_bound), [&](auto& knot) {
            const double gap = std::abs(knot.first - s);
            return std::min(gap, outline_.length_um() - gap) < kShortestPiece * edge_;
          });
      if (is_free) knots.push_back({s, graph_.add_vertex(outline_.at(s), kFibrePoint)});
    }
    if (knots.empty()) knots.push_back(sliding_vertex(outline_.length_um() * random_.uniform()));
    std::sort(knots.begin(), knots.end());
    Chain chain;
    chain.is_closed = true;
    for (std::size_t i = 0; i < knots.size(); ++i) {
      chain.vertices.push_back(knots[i].second);
      const bool is_last = i + 1 == knots.size();
      const double next = is_last ? knots.front().first + outline_.length_um() : knots[i + 1].first;
      const double arc = next - knots[i].first;
      const int fewest = knots.size() == 1 ? 6 : knots.size() == 2 ? 2 : 1;  // a closed line needs three vertices
      const int pieces = std::max(fewest, static_cast<int>(std::lround(arc / edge_)));
      for (int k = 1; k < pieces; ++k) {
        const double along = (k + random_.uniform(-kOutlineJitter, kOutlineJitter)) / pieces;
        chain.vertices.push_back(sliding_vertex(knots[i].first + along * arc).second);
      }
    }
    graph_.chains.push_back(std::move(chain));
  }

  std::pair<double, int> sliding_vertex(double s) {
    const int v = graph_.add_vertex(outline_.at(s), kOutlinePoint);
    slides_at_[v] = outline_.wrapped(s);
    return {outline_.wrapped(s), v};
  }

  /// Number the vertices that are on a chain or held, and gather what runs along each segment.
  void collect() {
    std::vector<int> number(graph_.points_um.size(), -1);
    const auto numbered = [&](int v) {
      if (number[v] >= 0) return number[v];
      number[v] = static_cast<int>(frame_.points_um.size());
      frame_.points_um.push_back(graph_.points_um[v]);
      const auto adhesion = adhesion_of_vertex_.find(v);
      frame_.adhesion_id.push_back(adhesion == adhesion_of_vertex_.end() ? 0 : adhesion->second->adhesion_id);
      const auto slide = slides_at_.find(v);
      frame_.outline_s_um.push_back(slide == slides_at_.end() ? std::numeric_limits<double>::quiet_NaN()
                                                              : slide->second);
      return number[v];
    };
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
        if (chain.fibre_id == 0) {
          ++segment.outline_count;
        } else if (!std::binary_search(segment.fibre_ids.begin(), segment.fibre_ids.end(), chain.fibre_id)) {
          segment.fibre_ids.insert(std::lower_bound(segment.fibre_ids.begin(), segment.fibre_ids.end(), chain.fibre_id),
                                   chain.fibre_id);
        }
      }
    }
    std::vector<int> degree(frame_.points_um.size(), 0);
    for (const auto& [ends, segment] : segments) {
      frame_.segments.push_back(segment);
      frame_.n_shared_segments += segment.fibre_ids.size() > 1;
      ++degree[segment.vertex_a];
      ++degree[segment.vertex_b];
      if (segment.fibre_ids.empty() && segment.outline_count == 1) continue;
      for (const int v : {segment.vertex_a, segment.vertex_b}) hold(v);
    }
    for (std::size_t v = 0; v < degree.size(); ++v) {
      if (degree[v] != 2) hold(static_cast<int>(v));
    }
  }

  void hold(int v) { frame_.outline_s_um[v] = std::numeric_limits<double>::quiet_NaN(); }

  const Cell& cell_;
  const OutlineCurve& outline_;
  double edge_;
  Random& random_;
  PlanarGraph graph_;
  std::map<int, int> vertex_of_adhesion_;
  std::map<int, const Adhesion*> adhesion_of_vertex_;
  std::map<int, double> slides_at_;
  Frame frame_;
};

}  // namespace

bool covers(const Adhesion& adhesion, Vec2 point_um) {
  const Vec2 offset = point_um - adhesion.position_um;
  const Vec2 axis = {std::cos(adhesion.angle_rad), std::sin(adhesion.angle_rad)};
  const double along = 2 * dot(offset, axis) / adhesion.major_axis_um;
  const double across = 2 * cross(axis, offset) / adhesion.minor_axis_um;
  return along * along + across * across <= 1;
}

Frame build_frame(const Cell& cell, const OutlineCurve& outline, double edge_um, Random& random) {
  return Builder(cell, outline, edge_um, random).build();
}

}  // namespace mbtfm::network
