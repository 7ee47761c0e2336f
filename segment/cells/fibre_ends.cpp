#include "segment/cells/fibre_ends.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>

#include "pipeline/contract/polyline.h"
#include "segment/cells/candidates.h"
#include "segment/cells/ellipse.h"

namespace mbtfm::cells {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Share of its length along which a fibre follows the cell's edge.
constexpr double kMostOfIt = 0.6;

/// Dorsal fibres and arcs are short. A fibre that spans the cell is held at both ends, though the last micrometres of
/// it may be hidden: of 23 such lines found in a real cell, experts call 22 ventral.
bool is_long(const Polyline& line) {
  constexpr double kLong_um = 16;
  return length_um(line) > kLong_um;
}

/// The line's last point and those before it, 0.1 um apart over a length, the last first.
Polyline last_part(const Polyline& line, double length_um) {
  constexpr double kStep_um = 0.1;
  Polyline points{line.back()};
  double gone = 0, next = kStep_um;
  for (std::size_t i = line.size() - 1; i-- > 0 && next < length_um;) {
    const Vec2 d = line[i] - line[i + 1];
    const double l = norm(d);
    for (; next <= gone + l && next < length_um; next += kStep_um)
      points.push_back(line[i + 1] + ((next - gone) / l) * d);
    gone += l;
  }
  return points;
}

struct AlongEdge {
  double share = 0;       ///< of the line's length that runs along the outline
  double nearest_um = 0;  ///< of the line to the outline
};

/// A part runs along the outline if it is within 30° of it and no further away than `within_um`.
AlongEdge along_edge(const Polyline& points, const Polygon& outline_um, double within_um) {
  constexpr double kParallel = 0.866;  // cosine of 30°
  AlongEdge result{.share = 0, .nearest_um = kInfinite};
  std::size_t n_along = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const Vec2 d = points[i + 1] - points[i], away = points[i] - nearest_on_boundary_um(outline_um, points[i]);
    n_along += norm(away) < within_um && std::abs(cross(d, away)) >= kParallel * norm(d) * norm(away);
    result.nearest_um = std::min(result.nearest_um, norm(away));
  }
  result.share = static_cast<double>(n_along) / static_cast<double>(points.size() - 1);
  return result;
}

/// Of the middle of the line from its chord, towards the nearest edge; < 0 where it is bent inwards.
double bulge_um(const Polyline& points, const Polygon& outline_um) {
  const Vec2 middle = points[points.size() / 2], chord = 0.5 * (points.front() + points.back());
  const Vec2 nearest = nearest_on_boundary_um(outline_um, middle);
  const Vec2 outward = contains(outline_um, middle) ? nearest - middle : middle - nearest;
  return norm(outward) > 0 ? dot(middle - chord, outward) / norm(outward) : 0;
}

/// Or bent inwards.
bool is_straight(const Polyline& points, const Polygon& outline_um) {
  constexpr double kStraight = 0.02;
  return bulge_um(points, outline_um) <= kStraight * length_um(points);
}

/// Runs along the edge behind the lamellipodium and bulges towards it.
bool has_shape_of_arc(const Polyline& points, const Polygon& outline_um, double lamellipodium_um) {
  const AlongEdge along = along_edge(points, outline_um, kInfinite);
  return along.share >= kMostOfIt && along.nearest_um > lamellipodium_um && bulge_um(points, outline_um) > 0;
}

/// The adhesion that an end reaches best.
struct Hold {
  const Adhesion* adhesion = nullptr;
  double effort_um = kInfinite;  ///< way ahead to it and twice the way aside
  double gap_um = kInfinite;     ///< from the line's end to its rim, 0 inside
  double reach_um = 0;           ///< the effort up to which this end is held
  bool is_held() const { return adhesion != nullptr && effort_um <= reach_um; }
  /// That it is held, or not held as the case may be: 1 far from the limit, ½ on it. The place of an end is known to a
  /// third of the reach.
  double certainty() const {
    if (adhesion == nullptr) return 1;
    return 0.5 * (1 + std::erf(std::abs(effort_um - reach_um) / (reach_um / 3) / std::sqrt(2.0)));
  }
};

Vec2 direction_of_end(const Polyline& last) {
  const Vec2 d = last.front() - last.back();
  const double l = norm(d);
  return l > 0 ? (1 / l) * d : Vec2{1, 0};
}

/// Least effort from the course of the line around its end to the adhesion: some way back along the line, as far
/// straight ahead.
double effort_to(const Adhesion& adhesion, const Polyline& last, double ahead_cost, double farthest_um) {
  constexpr double kAside = 2;   // a fibre goes on ahead, it does not turn aside
  constexpr double kBack = 0.3;  // a line may run on a little over the adhesion that holds it
  const Vec2 ahead = direction_of_end(last);
  constexpr double kStep_um = 0.1;
  const auto aside = [&](Vec2 p) { return kAside * std::max(0.0, distance_to_ellipse_um(adhesion, p)); };
  double least = kInfinite;
  for (std::size_t i = 0; i < last.size(); ++i)
    least = std::min(least, aside(last[i]) + kBack * kStep_um * static_cast<double>(i));
  for (double s = 0; s <= farthest_um; s += kStep_um)
    least = std::min(least, aside(last.front() + s * ahead) + ahead_cost * s);
  return least;
}

/// 1 for an end that points at the nearest edge and lies near to it, −1 for one that runs along it, 0 far away.
double outwardness(const Polyline& last, const Polygon& outline_um) {
  if (outline_um.empty()) return 0;
  constexpr double kPeriphery_um = 6;  // beyond it few adhesions lie, and the nearest edge means little
  const Vec2 to_edge = nearest_on_boundary_um(outline_um, last.front()) - last.front();
  const double distance = norm(to_edge);
  if (distance < 1e-9) return 1;
  const double cosine = std::abs(dot(to_edge, direction_of_end(last))) / distance;
  return (2 * cosine * cosine - 1) * std::exp(-distance / kPeriphery_um);
}

/// Let the line end at the centre: leave out what lies past it, and the last points within a micrometre of it. Points
/// of a line may lie far apart, so that it passes the centre between two of them.
void lead_to(Polyline& line, const Adhesion& adhesion) {
  const Vec2 centre = adhesion.position_um;
  std::size_t nearest = 0;
  Vec2 foot = line.front();
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Vec2 candidate = line[i] + nearest_share(line[i], line[i + 1], centre) * (line[i + 1] - line[i]);
    if (norm(candidate - centre) > norm(foot - centre)) continue;
    nearest = i;
    foot = candidate;
  }
  line.resize(nearest + 1);
  if (!(foot == line.back())) line.push_back(foot);
  const double clear = std::max(0.5, adhesion.major_axis_um / 2);
  while (line.size() > 1 && norm(line.back() - centre) < clear) line.pop_back();
  line.push_back(centre);
}

/// Would a line that is led to the adhesion's centre end in a hook? A fibre pulls its adhesion along its own course: of
/// 436 tied ends of simulated cells three had such a hook, and all three were tied to the wrong adhesion.
bool would_hook(Polyline line, const Adhesion& adhesion) {
  constexpr double kCourse_um = 2, kShort_um = 0.8;
  constexpr double kTurn = 0.766;  // cosine of 40°
  lead_to(line, adhesion);
  if (line.size() < 3) return false;
  const Vec2 hook = line.back() - line[line.size() - 2];
  line.pop_back();
  const Vec2 ahead = direction_of_end(last_part(line, kCourse_um));
  return norm(hook) >= kShort_um && dot(hook, ahead) < kTurn * norm(hook);
}

/// The adhesion at the line's last point.
Hold hold_of(const Polyline& line, const std::vector<Adhesion>& adhesions, const Polygon& outline_um, double reach_um) {
  constexpr double kDirectionCounts = 0.3;  // of the reach: it decides near the limit and nowhere else
  const bool is_along_edge = runs_along_free_edge(line, outline_um);
  // its end fades: it may be longer than it looks, a fibre that must be held at both ends by more
  const double ahead_cost = is_long(line) || is_along_edge ? 0.23 : 0.7;
  const Polyline last = last_part(line, reach_um * 0.7 / ahead_cost);
  Hold best;
  double least = kInfinite;
  for (const Adhesion& a : adhesions) {
    if (norm(a.position_um - line.back()) > 3 * reach_um + a.major_axis_um || would_hook(line, a)) continue;
    const double effort = effort_to(a, last, ahead_cost, (1 + kDirectionCounts) * reach_um / ahead_cost);
    // between two that the line touches, the one whose centre it passes nearer
    const double cost = effort + 0.2 * distance_to_line_um({last.back(), last.front()}, a.position_um);
    if (cost < least) {
      least = cost;
      best = {&a, effort, std::max(0.0, distance_to_ellipse_um(a, line.back())), 0};
    }
  }
  best.reach_um = reach_um * (1 + kDirectionCounts * (is_along_edge ? 0 : outwardness(last, outline_um)));
  return best;
}

std::string in_words(const char* end, const Hold& hold) {
  char text[96];
  if (hold.adhesion == nullptr)
    std::snprintf(text, sizeof text, "%s far from any adhesion", end);
  else
    std::snprintf(text, sizeof text, "%s %s %.1f um from adhesion %d", end, hold.is_held() ? "held" : "free",
                  hold.gap_um, hold.adhesion->adhesion_id);
  return text;
}

/// Adhesions under the line between its ends: it may be two fibres, or held there too.
std::string under(const Polyline& line, const Hold& start, const Hold& end, const std::vector<Adhesion>& adhesions) {
  std::string text;
  for (const Adhesion& a : adhesions) {
    if (&a == start.adhesion || &a == end.adhesion) continue;
    // not a mere touch: it passes within half of the minor axis' half
    if (distance_to_line_um(line, a.position_um) < a.minor_axis_um / 4)
      text += (text.empty() ? "; over adhesion " : " and ") + std::to_string(a.adhesion_id);
  }
  return text;
}

/// The points of the way up to the first adhesion; none where it reaches none, or is too faint before.
Polyline to_adhesion(const WayOn& way, const std::vector<Adhesion>& adhesions) {
  constexpr double kFaint = 2, kShare = 0.8;  // the best way through texture is as bright for half of its length
  std::size_t n_seen = 0;
  for (std::size_t i = 0; i < way.points_um.size(); ++i) {
    n_seen += way.over_noise[i] > kFaint;
    if (static_cast<double>(n_seen) < kShare * static_cast<double>(i + 1)) continue;
    if (std::ranges::any_of(adhesions,
                            [&](const Adhesion& a) { return distance_to_ellipse_um(a, way.points_um[i]) <= 0; }))
      return {way.points_um.begin(), way.points_um.begin() + static_cast<std::ptrdiff_t>(i) + 1};
  }
  return {};
}

}  // namespace

bool runs_along_free_edge(const Polyline& line, const Polygon& outline_um) {
  if (outline_um.empty() || line.size() < 2) return false;
  constexpr double kBeside_um = 1.5;
  const Polyline points = last_part(line, length_um(line));
  if (along_edge(points, outline_um, kBeside_um).share < kMostOfIt) return false;
  return is_straight(points, outline_um);
}

void lead_on(TracedFibre& traced, const std::vector<Adhesion>& adhesions, const Polygon& outline_um, double reach_um) {
  Polyline& line = traced.fibre.points_um;
  for (const WayOn* way : {&traced.before, &traced.after}) {
    std::reverse(line.begin(), line.end());
    if (hold_of(line, adhesions, outline_um, reach_um).is_held()) continue;
    if (!is_long(line)) continue;
    const Polyline on = to_adhesion(*way, adhesions);
    line.insert(line.end(), on.begin(), on.end());
  }
}

EndsToTie ends_held_by_shape(const Polyline& line, const Polygon& outline_um, double band_um, double lamellipodium_um) {
  constexpr double kCourse_um = 2;  // of the line's end shows where it points
  constexpr double kInward = 0.5;   // cosine of 60°: pieces of other fibres point anywhere
  struct End {
    double to_edge_um = 0, outward = 0;  ///< cosine to the direction of the nearest edge
  };
  if (is_long(line) || line.size() < 2) return {};
  const Polyline points = last_part(line, length_um(line));
  if (points.size() < 2) return {};
  if (has_shape_of_arc(points, outline_um, lamellipodium_um)) return {.start = false, .end = false};
  const auto pointing = [&](const Polyline& towards_end) {
    const Polyline last = last_part(towards_end, kCourse_um);
    const Vec2 to_edge = nearest_on_boundary_um(outline_um, last.front()) - last.front();
    const double distance = norm(to_edge);
    return End{distance, distance > 0 ? dot(to_edge, direction_of_end(last)) / distance : 1};
  };
  const End end = pointing(line), start = pointing({line.rbegin(), line.rend()});
  const auto rises = [&](const End& outer, const End& inner) {
    return outer.to_edge_um <= band_um && outer.outward > 0 && inner.to_edge_um > band_um && inner.outward < -kInward;
  };
  return {.start = !rises(end, start), .end = !rises(start, end)};
}

void tie_ends(Fibre& fibre, const std::vector<Adhesion>& adhesions, const Polygon& outline_um, double reach_um,
              EndsToTie ends) {
  Polyline& line = fibre.points_um;
  const bool is_along_edge = runs_along_free_edge(line, outline_um);
  Hold end = ends.end ? hold_of(line, adhesions, outline_um, reach_um) : Hold{};
  std::reverse(line.begin(), line.end());
  Hold start = ends.start ? hold_of(line, adhesions, outline_um, reach_um) : Hold{};
  if (start.adhesion == end.adhesion && start.adhesion != nullptr)
    (start.effort_um <= end.effort_um ? end : start) = Hold{};
  fibre.type_confidence = start.certainty() * end.certainty();
  fibre.type_reason = in_words("start", start) + "; " + in_words("end", end) + under(line, start, end, adhesions);
  fibre.start_adhesion_id.reset();
  fibre.end_adhesion_id.reset();
  if (start.is_held()) {
    lead_to(line, *start.adhesion);
    fibre.start_adhesion_id = start.adhesion->adhesion_id;
  }
  std::reverse(line.begin(), line.end());
  if (end.is_held()) {
    lead_to(line, *end.adhesion);
    fibre.end_adhesion_id = end.adhesion->adhesion_id;
  }
  const int n_tied = fibre.start_adhesion_id.has_value() + fibre.end_adhesion_id.has_value();
  fibre.type = n_tied == 2   ? is_along_edge ? FibreType::edge : FibreType::ventral
               : n_tied == 1 ? FibreType::dorsal
                             : FibreType::arc;
  if (fibre.type == FibreType::edge) fibre.type_reason += "; along a free edge";
  if (n_tied == 0 && !outline_um.empty() && is_straight(last_part(line, length_um(line)), outline_um)) {
    // of 27 such lines of simulated cells 7 are arcs, 10 are pieces of other fibres, and 10 are none
    fibre.type_confidence = std::min(fibre.type_confidence, is_long(line) ? 0.5 : 0.26);
    fibre.type_reason += "; arcs bulge towards the edge";
  }
  if (n_tied < 2 && is_long(line) && !adhesions.empty()) {
    fibre.type_confidence = std::min(fibre.type_confidence, 0.5);
    fibre.type_reason += "; fibres as long as this are usually held at both ends";
  }
}

void weigh_free_end(TracedFibre& traced, const Polygon& outline_um) {
  constexpr std::array kCoefficients{-2.80, 4.70, 1.83, -0.96, -4.23};
  Fibre& fibre = traced.fibre;
  if (fibre.type != FibreType::dorsal || outline_um.empty()) return;
  const bool is_first = !fibre.start_adhesion_id;
  const WayOn& way = is_first ? traced.before : traced.after;
  Vec2 free = fibre.points_um.front(), held = fibre.points_um.back();
  if (!is_first) std::swap(free, held);
  const double deeper_um = distance_to_boundary_um(outline_um, free) - distance_to_boundary_um(outline_um, held);
  const double root = std::sqrt(std::max(traced.evidence.length_um, 1.0)),
               brightness = std::log(std::max(traced.evidence.significance, 1.0) / root);
  const double chance =
      logistic({1, deeper_um / std::max(norm(free - held), 1e-9), brightness, way.beyond, way.goes_on}, kCoefficients);
  fibre.type_confidence *= chance;
  if (chance < 0.5) fibre.type_reason += "; its free end may be where the line was lost";
}

bool is_on_cut(Vec2 end, const Cuts& cuts) {
  constexpr double kOnIt_um = 1e-6;
  return std::ranges::any_of(
      cuts, [&](const auto& cut) { return distance_to_segment_um(end, cut.first, cut.second) < kOnIt_um; });
}

void lead_to_cut(Fibre& fibre, const Cuts& cuts, double reach_um) {
  if (cuts.empty()) return;
  constexpr double kCourse_um = 1;  // of the line's end shows where it points
  const auto leads = [&](Polyline& line) {
    const Polyline last = last_part(line, kCourse_um);
    const Vec2 from = last.front(), ahead = direction_of_end(last);
    if (is_on_cut(from, cuts)) return true;
    double way_um = kInfinite;
    for (const auto& [a, b] : cuts) {
      const double across = cross(ahead, b - a);
      if (across == 0) continue;
      const double way = cross(a - from, b - a) / across, along = cross(a - from, ahead) / across;
      if (way > 0 && along >= 0 && along <= 1) way_um = std::min(way_um, way);
    }
    if (way_um > reach_um) return false;
    line.push_back(from + way_um * ahead);
    return true;
  };
  bool leaves = !fibre.end_adhesion_id && leads(fibre.points_um);
  std::reverse(fibre.points_um.begin(), fibre.points_um.end());
  leaves = (!fibre.start_adhesion_id && leads(fibre.points_um)) || leaves;
  std::reverse(fibre.points_um.begin(), fibre.points_um.end());
  if (!leaves) return;
  fibre.type_confidence = std::min(fibre.type_confidence, 0.5);
  fibre.type_reason += "; leaves the image";
}

namespace {

/// Fibres that are held at both ends, wherever adhesions are seen: those that span the cell, and bundles along a free
/// edge of which one end is held. A long line that nothing seems to hold is either or an arc, and its shape says
/// which.
bool is_held_at_both(const Fibre& fibre, const Polygon& outline_um, double lamellipodium_um) {
  const Polyline& line = fibre.points_um;
  if (fibre.start_adhesion_id || fibre.end_adhesion_id) return is_long(line) || runs_along_free_edge(line, outline_um);
  if (!is_long(line) || outline_um.empty()) return false;
  const Polyline points = last_part(line, length_um(line));
  return is_straight(points, outline_um) || !has_shape_of_arc(points, outline_um, lamellipodium_um);
}

}  // namespace

void hold_far_ends(std::vector<Fibre>& fibres, std::vector<Adhesion>& adhesions, const Polygon& outline_um,
                   const Cuts& cuts, const FarEnds& p) {
  Anchors anchors(adhesions, p.anchor_area_um2);
  for (Fibre& fibre : fibres) {
    struct End {
      Vec2& point;
      std::optional<int>& adhesion_id;
    } ends[] = {{fibre.points_um.front(), fibre.start_adhesion_id}, {fibre.points_um.back(), fibre.end_adhesion_id}};
    const auto is_free = [](const End& end) { return !end.adhesion_id; };
    const auto n_free = std::ranges::count_if(ends, is_free);
    if (n_free == 0 || !is_held_at_both(fibre, outline_um, p.lamellipodium_um)) continue;
    if (std::ranges::any_of(ends, [&](const End& end) { return is_free(end) && is_on_cut(end.point, cuts); })) continue;
    const bool is_along_edge = runs_along_free_edge(fibre.points_um, outline_um);
    for (End& end : ends) {
      if (!is_free(end)) continue;
      const Adhesion held_by = anchors.at(end.point);
      end.point = held_by.position_um;
      end.adhesion_id = held_by.adhesion_id;
    }
    fibre.type = is_along_edge ? FibreType::edge : FibreType::ventral;
    if (n_free == 1) fibre.type_confidence = 0.9;  // of 23 such lines in a real cell, experts call 22 ventral
    fibre.type_reason +=
        is_along_edge ? "; along a free edge, held at both ends" : "; it spans the cell, held at both ends";
    fibre.type_reason += n_free == 1 ? ": an anchor at the far one" : ": anchors at both";
  }
}

}  // namespace mbtfm::cells
