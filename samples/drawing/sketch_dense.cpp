#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "pipeline/contract/errors.h"
#include "samples/drawing/geometry.h"
#include "samples/drawing/sketch.h"

namespace mbtfm::drawing {

namespace {

/// Fibres that meet at a smaller angle lie side by side, and keep the least distance of a carpet.
constexpr double kAlongside_rad = 12 * std::numbers::pi / 180;
constexpr double kShortestDenseVentral_um = 10;  ///< ventral fibres span a good part of the cell
constexpr double kMerge_um = 6;                  ///< the last part of a fibre that bends to its neighbour's adhesion
constexpr int kCarpets = 3;                      ///< groups of ventral fibres side by side
constexpr double kMerging = 0.2;                 ///< of their fibres that end on their neighbour's adhesion
constexpr int kTries = 60;                       ///< for one fibre of a group, before the next place is tried

/// One end of a fibre: free, on an adhesion of its own, or on one that is there already.
struct End {
  std::optional<Adhesion> fresh;
  std::optional<int> shared_id;
  bool is_held() const { return fresh || shared_id; }
};

struct Plan {
  Polyline points_um;
  End start, end;
  FibreType type = FibreType::ventral;
};

double depth_um(const Sketch& sketch, Vec2 point) {
  return contains(sketch.outline_um, point) ? distance_to_boundary_um(sketch.outline_um, point) : -1;
}

/// Do two fibres lie side by side too closely? They may cross, and meet where they share an adhesion.
bool lie_too_near(const Polyline& a, const Polyline& b, double least_um, const std::vector<Vec2>& shared_um) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool is_merging = std::ranges::any_of(shared_um, [&](Vec2 p) { return norm(a[i] - p) < kMerge_um + 1; });
    if (is_merging) continue;
    for (std::size_t j = 0; j < b.size(); ++j)
      if (norm(a[i] - b[j]) < least_um && std::abs(cross(tangent(a, i), tangent(b, j))) < std::sin(kAlongside_rad))
        return true;
  }
  return false;
}

/// Clear of what is there: inside the cell, beside the other fibres, over no adhesion but its own.
bool fits(const Sketch& sketch, const Plan& plan) {
  const CellParameters& p = sketch.parameters;
  const double edge_um = plan.type == FibreType::edge ? 0.4 : 1.0;
  std::vector<Vec2> shared;
  for (const auto& [end, at] : {std::pair(&plan.start, plan.points_um.front()), {&plan.end, plan.points_um.back()}}) {
    if (end->shared_id) shared.push_back(at);
    if (end->fresh && !has_room(sketch, *end->fresh)) return false;
  }
  for (std::size_t i = 0; i < plan.points_um.size(); ++i) {
    const bool is_end = i < 4 || i + 4 >= plan.points_um.size();
    if (depth_um(sketch, plan.points_um[i]) < (is_end ? 0.5 : edge_um)) return false;
  }
  for (const Adhesion& a : sketch.adhesions) {
    const bool is_own = plan.start.shared_id == a.adhesion_id || plan.end.shared_id == a.adhesion_id;
    const double margin = 0.5 * p.fibre_width_um + p.adhesion_clearance_um;
    if (!is_own && std::ranges::any_of(plan.points_um, [&](Vec2 q) { return covers(a, q, margin); })) return false;
    if (!plan.start.is_held() && covers(a, plan.points_um.front(), p.free_end_clearance_um)) return false;
    if (!plan.end.is_held() && covers(a, plan.points_um.back(), p.free_end_clearance_um)) return false;
  }
  if (plan.start.fresh && !plan.end.is_held() &&
      covers(*plan.start.fresh, plan.points_um.back(), p.free_end_clearance_um))
    return false;
  if (plan.start.fresh && plan.end.fresh && too_near(*plan.start.fresh, *plan.end.fresh, p.adhesion_clearance_um))
    return false;
  return std::ranges::none_of(sketch.fibres, [&](const Fibre& f) {
    return lie_too_near(plan.points_um, f.points_um, 0.9 * p.carpet_smallest_um, shared);
  });
}

void place(Sketch& sketch, Plan plan) {
  for (End* end : {&plan.start, &plan.end})
    if (end->fresh) end->shared_id = add_adhesion(sketch, *end->fresh);
  add_fibre(sketch, std::move(plan.points_um), plan.type, plan.start.shared_id, plan.end.shared_id);
}

Adhesion at_end(const Sketch& sketch, const Polyline& line, bool is_start, double tension_nN, Random& random) {
  return holding_adhesion(sketch.parameters, is_start ? line.front() : line.back(),
                          tangent(line, is_start ? 0 : line.size() - 1), tension_nN, random);
}

/// Bend the last part of a line so that it ends at a point.
void lead_end_to(Polyline& line, Vec2 target) {
  const Vec2 shift = target - line.back();
  double to_end = 0;
  for (std::size_t i = line.size(); i-- > 0;) {
    if (i + 1 < line.size()) to_end += norm(line[i + 1] - line[i]);
    const double t = std::clamp(1 - to_end / kMerge_um, 0.0, 1.0);
    if (t == 0) break;
    line[i] += (t * t * (3 - 2 * t)) * shift;
  }
}

/// Along the free arc from corner to corner, a little inside of it.
std::optional<Plan> plan_edge(const Sketch& sketch, const FreeEdge& edge, double tension_nN, Random& random) {
  const int n = static_cast<int>(sketch.outline_um.size());
  const double inset_um = random.uniform(0.6, 1.0);
  const int from = edge.first + static_cast<int>(random.uniform(1.5, 4) / kOutlineSpacing_um);
  const int length = (edge.last - edge.first + n) % n;
  const int to = edge.first + length - static_cast<int>(random.uniform(1.5, 4) / kOutlineSpacing_um);
  Plan plan;
  plan.type = FibreType::edge;
  for (int i = from; i <= to; ++i)
    plan.points_um.push_back(sketch.outline_um[i % n] + inset_um * inward_normal(sketch, i % n));
  if (plan.points_um.size() < 12) return std::nullopt;
  plan.points_um = resampled(plan.points_um, kFibreSpacing_um);
  plan.start.fresh = at_end(sketch, plan.points_um, true, tension_nN, random);
  plan.end.fresh = at_end(sketch, plan.points_um, false, tension_nN, random);
  return plan;
}

/// Fibres side by side, that fan out towards one end.
struct Carpet {
  Vec2 centre_um, along;
  double fan_per_um = 0;   ///< the distances of neighbours grow along it by this share, from the narrow end on
  double bend_per_um = 0;  ///< curvature
  Vec2 at(double s, double offset) const {
    constexpr double kNarrow_um = 15;  // from the middle to the narrow end
    const double from_narrow_um = std::max(0.0, kNarrow_um + (fan_per_um > 0 ? s : -s));
    const double across = offset * (1 + std::abs(fan_per_um) * from_narrow_um) + 0.5 * bend_per_um * s * s;
    return centre_um + s * along + across * left_of(along);
  }
};

Vec2 long_axis(const Polygon& outline, Vec2 centre) {
  double xx = 0, xy = 0, yy = 0;
  for (const Vec2 p : outline) {
    const Vec2 d = p - centre;
    xx += d.x * d.x, xy += d.x * d.y, yy += d.y * d.y;
  }
  return direction(0.5 * std::atan2(2 * xy, xx - yy));
}

Carpet draw_carpet(const Sketch& sketch, int i, Random& random) {
  constexpr double kAcross_rad[] = {0.1, -0.1, 0.4, -0.4};  // the first two along the cell, further ones cross them
  const Vec2 axis = long_axis(sketch.outline_um, sketch.centre_um);
  const double turn = kAcross_rad[i % 4] + 0.15 * random.normal();
  Carpet carpet;
  carpet.along = direction(std::atan2(axis.y, axis.x) + turn);
  const double side = (i % 4 == 0 ? 1 : i % 4 == 1 ? -1 : 0) * 0.2 + 0.06 * random.normal();
  carpet.centre_um = sketch.centre_um + (side * sketch.parameters.diameter_um) * left_of(carpet.along) +
                     (2 * random.normal()) * carpet.along;
  carpet.fan_per_um = std::clamp(0.015 * random.normal(), -0.03, 0.03);
  carpet.bend_per_um = std::clamp(0.01 * random.normal(), -0.02, 0.02);
  return carpet;
}

/// From the carpet's middle outwards to the depth at which the fibre ends.
double reach_um(const Sketch& sketch, const Carpet& carpet, double offset, int way, double end_depth_um) {
  double s = 0;
  while (s < 60 && depth_um(sketch, carpet.at(way * (s + kFibreSpacing_um), offset)) > end_depth_um)
    s += kFibreSpacing_um;
  return s;
}

std::optional<Plan> plan_ventral(const Sketch& sketch, const Carpet& carpet, double offset, double tension_nN,
                                 Random& random) {
  if (depth_um(sketch, carpet.at(0, offset)) < 2) return std::nullopt;
  Carpet own = carpet;  // each goes its own way a little
  own.fan_per_um += 0.002 * random.normal();
  own.bend_per_um += 0.001 * random.normal();
  double reach[2];
  for (const int k : {0, 1}) {
    reach[k] = reach_um(sketch, own, offset, 2 * k - 1, random.uniform(1.5, 6));
    if (random.uniform() < 0.25) reach[k] *= random.uniform(0.5, 0.9);  // some end in the middle of the cell
  }
  if (reach[0] + reach[1] < kShortestDenseVentral_um) return std::nullopt;
  Plan plan;
  const double swing_um = 0.1 * random.normal(), wave_per_um = 2 * std::numbers::pi / random.uniform(6, 15);
  for (double s = -reach[0]; s <= reach[1]; s += kFibreSpacing_um)
    plan.points_um.push_back(own.at(s, offset + swing_um * std::sin(wave_per_um * s)));
  const int merging = random.uniform() < kMerging ? random.below(2) : -1;
  if (merging >= 0 && !sketch.fibres.empty() && sketch.fibres.back().type == FibreType::ventral) {
    const Fibre& neighbour = sketch.fibres.back();
    const Vec2 target = merging == 0 ? neighbour.points_um.front() : neighbour.points_um.back();
    const Vec2 here = merging == 0 ? plan.points_um.front() : plan.points_um.back();
    if (norm(target - here) < 3) {
      if (merging == 0) std::ranges::reverse(plan.points_um);
      lead_end_to(plan.points_um, target);
      if (merging == 0) std::ranges::reverse(plan.points_um);
      (merging == 0 ? plan.start : plan.end).shared_id =
          merging == 0 ? neighbour.start_adhesion_id : neighbour.end_adhesion_id;
    }
  }
  if (!plan.start.shared_id) plan.start.fresh = at_end(sketch, plan.points_um, true, tension_nN, random);
  if (!plan.end.shared_id) plan.end.fresh = at_end(sketch, plan.points_um, false, tension_nN, random);
  return plan;
}

/// From an adhesion near the edge inwards, like its neighbours in the fan but turned.
std::optional<Plan> plan_dorsal(const Sketch& sketch, std::optional<int> shared_id, double tension_nN, Random& random) {
  const int n = static_cast<int>(sketch.outline_um.size());
  const int boundary = random.below(n);
  Vec2 start = sketch.outline_um[boundary] + random.uniform(1.2, 3) * inward_normal(sketch, boundary);
  if (shared_id) start = sketch.adhesions[static_cast<std::size_t>(*shared_id) - 1].position_um;
  const Vec2 inward = sketch.centre_um - start;
  const double angle = std::atan2(inward.y, inward.x) + std::clamp(0.35 * random.normal(), -0.8, 0.8);
  const double length = random.uniform(5, 11);
  if (length > 0.75 * norm(inward)) return std::nullopt;
  Plan plan;
  plan.type = FibreType::dorsal;
  plan.points_um =
      parabola(start, start + length * direction(angle), 0.03 * random.normal() * length, kFibreSpacing_um);
  if (shared_id) {
    const Fibre& last = sketch.fibres.back();
    const double turn = cross(tangent(last.points_um, 0), tangent(plan.points_um, 0));
    if (std::abs(turn) < std::sin(kAlongside_rad) || std::abs(turn) > 0.6) return std::nullopt;
    plan.start.shared_id = shared_id;
  } else {
    plan.start.fresh = at_end(sketch, plan.points_um, true, tension_nN, random);
  }
  return plan;
}

/// A piece of the outline, smoothed and drawn in towards the centre; further ones of a stack lie further in.
struct ArcStack {
  int first = 0;
  double scale = 0.8, length_um = 12;
};

ArcStack draw_stack(const Sketch& sketch, Random& random) {
  return {random.below(static_cast<int>(sketch.outline_um.size())), random.uniform(0.55, 0.82), random.uniform(7, 16)};
}

Plan plan_arc(const Sketch& sketch, const ArcStack& stack) {
  Polygon inner = smoothed_closed(sketch.outline_um, 6);
  const int n = static_cast<int>(inner.size());
  Plan plan;
  plan.type = FibreType::arc;
  double so_far = 0;
  for (int i = 0; so_far < stack.length_um && i < n; ++i) {
    plan.points_um.push_back(sketch.centre_um + stack.scale * (inner[(stack.first + i) % n] - sketch.centre_um));
    if (i > 0) so_far += norm(plan.points_um.back() - plan.points_um[plan.points_um.size() - 2]);
  }
  plan.points_um = resampled(plan.points_um, kFibreSpacing_um);
  return plan;
}

[[noreturn]] void no_room(const Sketch& sketch, FibreType type) {
  throw UsageError("no room for another " + std::string(name_of(type)) + " fibre after " +
                   std::to_string(sketch.fibres.size()) + ": ask for fewer, or a smaller carpet_smallest_um");
}

/// Places fibres one by one and keeps their tensions.
struct Builder {
  Sketch& sketch;
  const std::function<double(FibreType)>& tension_of;
  Random& random;
  std::vector<double> tensions_nN{};

  /// One fibre, if one of some tries fits. @param plan_of  (tension) -> std::optional<Plan>
  bool add(FibreType type, int n_tries, const auto& plan_of) {
    const double tension_nN = tension_of(type);
    for (int i = 0; i < n_tries; ++i) {
      std::optional<Plan> plan = plan_of(tension_nN);
      if (!plan || !fits(sketch, *plan)) continue;
      place(sketch, std::move(*plan));
      tensions_nN.push_back(tension_nN);
      return true;
    }
    return false;
  }
  int n_of(FibreType type) const { return static_cast<int>(std::ranges::count(sketch.fibres, type, &Fibre::type)); }

  void add_edges() {
    for (const FreeEdge& edge : sketch.free_edges)
      if (!add(FibreType::edge, kTries, [&](double t) { return plan_edge(sketch, edge, t, random); }))
        no_room(sketch, FibreType::edge);
  }

  /// To both sides of the carpet's middle line until it is full, leaves the cell or finds no room.
  void add_carpet(const Carpet& carpet, int n_fibres) {
    const CellParameters& p = sketch.parameters;
    double offsets[2] = {0, 0};
    for (int i = 0, misses = 0; i < n_fibres && misses < 8; ++i) {
      double& offset = offsets[i % 2];
      const int side = i % 2 == 0 ? 1 : -1;
      const double ratio = p.carpet_largest_um / p.carpet_smallest_um;
      offset += side * p.carpet_smallest_um * std::pow(ratio, random.uniform());
      if (!add(FibreType::ventral, kTries, [&](double t) { return plan_ventral(sketch, carpet, offset, t, random); }))
        ++misses, ++n_fibres;
    }
  }

  void add_carpets() {
    const CellParameters& p = sketch.parameters;
    for (int i = 0; n_of(FibreType::ventral) < p.n_ventral; ++i) {
      if (i >= 20 * kCarpets) no_room(sketch, FibreType::ventral);
      const int left = p.n_ventral - n_of(FibreType::ventral);
      const int share = (p.n_ventral + kCarpets - 1) / kCarpets;
      add_carpet(draw_carpet(sketch, i, random), std::min(left, i % 4 < 2 ? share + 2 : std::max(2, share / 2)));
    }
  }

  void add_dorsal_fans() {
    while (n_of(FibreType::dorsal) < sketch.parameters.n_dorsal) {
      if (!add(FibreType::dorsal, kMaxTries, [&](double t) { return plan_dorsal(sketch, {}, t, random); }))
        no_room(sketch, FibreType::dorsal);
      const int id = *sketch.fibres.back().start_adhesion_id;
      for (int k = random.below(3); k > 0 && n_of(FibreType::dorsal) < sketch.parameters.n_dorsal; --k)
        add(FibreType::dorsal, kTries, [&](double t) { return plan_dorsal(sketch, id, t, random); });
    }
  }

  void add_arcs() {
    const CellParameters& p = sketch.parameters;
    for (int i = 0; n_of(FibreType::arc) < p.n_arc; ++i) {
      if (i >= kMaxTries) no_room(sketch, FibreType::arc);
      ArcStack stack = draw_stack(sketch, random);
      for (int k = 0; k < 3 && n_of(FibreType::arc) < p.n_arc; ++k) {
        if (!add(FibreType::arc, 1, [&](double) { return std::optional(plan_arc(sketch, stack)); })) break;
        stack.scale -= random.uniform(1.2, 1.5) * p.carpet_largest_um / p.diameter_um;
        stack.length_um *= random.uniform(0.7, 1.1);
      }
    }
  }
};

}  // namespace

std::vector<double> draw_dense_fibres(Sketch& sketch, const std::function<double(FibreType)>& tension_nN,
                                      Random& random) {
  Builder builder{sketch, tension_nN, random};
  builder.add_edges();
  builder.add_carpets();
  builder.add_dorsal_fans();
  builder.add_arcs();
  return std::move(builder.tensions_nN);
}

}  // namespace mbtfm::drawing
