#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "pipeline/contract/errors.h"
#include "samples/drawing/geometry.h"
#include "samples/drawing/sketch.h"

namespace mbtfm::drawing {

namespace {

/// Where a fibre may run: this far inside the edge, so that it is not taken for the edge's own actin.
constexpr double kEdgeDistance_um = 2.5;
/// Fibres that meet at a smaller angle run alongside, and must keep their distance.
constexpr double kCrossingAngle_rad = 35 * std::numbers::pi / 180;

constexpr double kShortestVentral_um = 12, kLongestVentral_um = 45;
constexpr double kShortestDorsal_um = 6, kLongestDorsal_um = 14;
constexpr double kShortestArc_um = 7, kLongestArc_um = 18;

/// A fibre of which only the course is decided.
struct Proposal {
  Polyline points_um;
  std::optional<Adhesion> start, end;
};

bool is_inside(const Sketch& sketch, Vec2 point, double depth_um) {
  return contains(sketch.outline_um, point) && distance_to_boundary_um(sketch.outline_um, point) >= depth_um;
}

bool keeps_inside(const Sketch& sketch, const Proposal& proposal) {
  for (const Vec2 point : proposal.points_um) {
    // a held end lies nearer to the edge than the rest of the fibre
    const bool is_near_start = proposal.start && norm(point - proposal.points_um.front()) < 4;
    const bool is_near_end = proposal.end && norm(point - proposal.points_um.back()) < 4;
    if (!is_inside(sketch, point, is_near_start || is_near_end ? 0.5 : kEdgeDistance_um)) return false;
  }
  return true;
}

bool is_end(const Polyline& line, std::size_t i) { return i == 0 || i + 1 == line.size(); }

/// Do two fibres run alongside too closely, or does one end on the other? Crossing is no matter.
bool collide(const Polyline& a, const Polyline& b, double spacing_um) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (norm(a[i] - b[j]) >= spacing_um) continue;
      if (is_end(a, i) || is_end(b, j)) return true;
      if (std::abs(cross(tangent(a, i), tangent(b, j))) < std::sin(kCrossingAngle_rad)) return true;
    }
  }
  return false;
}

bool lies_on(const Sketch& sketch, const Polyline& points, const Adhesion& adhesion) {
  const double margin = 0.5 * sketch.parameters.fibre_width_um + sketch.parameters.adhesion_clearance_um;
  return std::ranges::any_of(points, [&](Vec2 p) { return covers(adhesion, p, margin); });
}

bool is_free_end_near(const Sketch& sketch, const Proposal& proposal, const Adhesion& adhesion) {
  const double margin = sketch.parameters.free_end_clearance_um;
  return (!proposal.start && covers(adhesion, proposal.points_um.front(), margin)) ||
         (!proposal.end && covers(adhesion, proposal.points_um.back(), margin));
}

bool fits(const Sketch& sketch, const Proposal& proposal, double spacing_um) {
  if (!keeps_inside(sketch, proposal)) return false;
  for (const Fibre& other : sketch.fibres)
    if (collide(proposal.points_um, other.points_um, spacing_um)) return false;
  for (const Adhesion& other : sketch.adhesions)
    if (lies_on(sketch, proposal.points_um, other) || is_free_end_near(sketch, proposal, other)) return false;
  for (const auto& held : {proposal.start, proposal.end})
    if (held && !has_room(sketch, *held)) return false;
  return !proposal.start || !is_free_end_near(sketch, proposal, *proposal.start);
}

/// A point of the outline, more often near a corner.
int boundary_point(const Sketch& sketch, Random& random) {
  const int n = static_cast<int>(sketch.outline_um.size());
  if (random.uniform() < 0.4) return random.below(n);
  const int corner = sketch.corner_points[random.below(static_cast<int>(sketch.corner_points.size()))];
  const int offset = static_cast<int>(std::lround(4 / kOutlineSpacing_um * random.normal()));
  return ((corner + offset) % n + n) % n;
}

/// An end for a fibre of this tension, just inside the edge; its adhesion reaches almost to it.
Vec2 peripheral_end(const Sketch& sketch, int boundary, double tension_nN, Random& random) {
  const CellParameters& p = sketch.parameters;
  const double area = std::clamp(tension_nN / p.adhesion_stress_kPa, p.adhesion_area_um2, p.largest_area_um2);
  const double half_length = std::sqrt(area * p.largest_aspect / std::numbers::pi);
  const double depth = half_length + random.uniform(0.4, 1.6);
  return sketch.outline_um[boundary] + depth * inward_normal(sketch, boundary);
}

/// Attach the adhesions: along the fibre at each end that is held.
void hold(const Sketch& sketch, Proposal& proposal, FibreType type, double tension_nN, Random& random) {
  const Polyline& points = proposal.points_um;
  if (type == FibreType::arc) return;
  proposal.start = holding_adhesion(sketch.parameters, points.front(), tangent(points, 0), tension_nN, random);
  if (type == FibreType::dorsal) return;
  proposal.end =
      holding_adhesion(sketch.parameters, points.back(), tangent(points, points.size() - 1), tension_nN, random);
}

std::optional<Proposal> propose_ventral(const Sketch& sketch, double tension_nN, Random& random) {
  const int n = static_cast<int>(sketch.outline_um.size());
  const Vec2 start = peripheral_end(sketch, boundary_point(sketch, random), tension_nN, random);
  const Vec2 end =
      random.uniform() < 0.65
          ? peripheral_end(sketch, boundary_point(sketch, random), tension_nN, random)
          : sketch.centre_um + random.uniform(0.1, 0.7) * (sketch.outline_um[random.below(n)] - sketch.centre_um);
  const double distance = norm(end - start);
  if (distance < kShortestVentral_um || distance > kLongestVentral_um) return std::nullopt;
  const double sag = std::clamp(0.02 * random.normal(), -0.04, 0.04) * distance;
  return Proposal{parabola(start, end, sag, kFibreSpacing_um), {}, {}};
}

std::optional<Proposal> propose_dorsal(const Sketch& sketch, double tension_nN, Random& random) {
  const Vec2 start = peripheral_end(sketch, boundary_point(sketch, random), tension_nN, random);
  const Vec2 inward = sketch.centre_um - start;
  const double turn = std::clamp(0.25 * random.normal(), -0.6, 0.6);
  const double angle = std::atan2(inward.y, inward.x) + turn;
  const double length = random.uniform(kShortestDorsal_um, kLongestDorsal_um);
  if (length > 0.75 * norm(inward)) return std::nullopt;  // it ends before the middle of the cell
  const double sag = 0.02 * random.normal() * length;
  return Proposal{parabola(start, start + length * direction(angle), sag, kFibreSpacing_um), {}, {}};
}

/// A piece of the outline, drawn in towards the centre and smoothed.
std::optional<Proposal> propose_arc(const Sketch& sketch, Random& random) {
  const double scale = random.uniform(0.5, 0.82);
  Polygon inner = smoothed_closed(sketch.outline_um, 6);
  for (Vec2& point : inner) point = sketch.centre_um + scale * (point - sketch.centre_um);
  const double length = random.uniform(kShortestArc_um, kLongestArc_um);
  const int n = static_cast<int>(inner.size());
  Polyline piece{inner[random.below(n)]};
  int i = static_cast<int>(std::ranges::find(inner, piece.front()) - inner.begin());
  for (double so_far = 0; so_far < length; so_far += norm(piece.back() - piece[piece.size() - 2])) {
    i = (i + 1) % n;
    piece.push_back(inner[i]);
  }
  return Proposal{resampled(piece, kFibreSpacing_um), {}, {}};
}

std::optional<Proposal> propose(const Sketch& sketch, FibreType type, double tension_nN, Random& random) {
  if (type == FibreType::dorsal) return propose_dorsal(sketch, tension_nN, random);
  if (type == FibreType::arc) return propose_arc(sketch, random);
  return propose_ventral(sketch, tension_nN, random);
}

void accept(Sketch& sketch, Proposal proposal) {
  add_fibre(sketch, std::move(proposal.points_um), proposal.start ? &*proposal.start : nullptr,
            proposal.end ? &*proposal.end : nullptr);
}

}  // namespace

Adhesion holding_adhesion(const CellParameters& p, Vec2 position_um, Vec2 along, double tension_nN, Random& random) {
  // a fibre's adhesion is larger than the mean even where the fibre pulls weakly
  const double grown = std::max(tension_nN / p.adhesion_stress_kPa, p.adhesion_area_um2 * random.uniform(1, 1.8));
  const double area = std::clamp(grown, p.smallest_area_um2, p.largest_area_um2);
  const double aspect = random.uniform(0.5 * (p.smallest_aspect + p.largest_aspect), p.largest_aspect);
  return make_adhesion(position_um, area, aspect, std::atan2(along.y, along.x));
}

int add_adhesion(Sketch& sketch, const Adhesion& adhesion) {
  sketch.adhesions.push_back(adhesion);
  return sketch.adhesions.back().adhesion_id = static_cast<int>(sketch.adhesions.size());
}

void add_fibre(Sketch& sketch, Polyline points_um, FibreType type, std::optional<int> start_id,
               std::optional<int> end_id) {
  Fibre& fibre = sketch.fibres.emplace_back();
  fibre.fibre_id = static_cast<int>(sketch.fibres.size());
  fibre.width_um = sketch.parameters.fibre_width_um;
  fibre.start_adhesion_id = start_id;
  fibre.end_adhesion_id = end_id;
  fibre.type = type;
  fibre.points_um = std::move(points_um);
}

void add_fibre(Sketch& sketch, Polyline points_um, const Adhesion* start, const Adhesion* end) {
  std::optional<int> start_id, end_id;
  if (start) start_id = add_adhesion(sketch, *start);
  if (end) end_id = add_adhesion(sketch, *end);
  const FibreType type = start && end ? FibreType::ventral : start || end ? FibreType::dorsal : FibreType::arc;
  add_fibre(sketch, std::move(points_um), type, start_id, end_id);
}

void draw_fibre(Sketch& sketch, FibreType type, double tension_nN, Random& random) {
  for (int i = 0; i < kMaxTries; ++i) {
    std::optional<Proposal> proposal = propose(sketch, type, tension_nN, random);
    if (!proposal) continue;
    hold(sketch, *proposal, type, tension_nN, random);
    if (fits(sketch, *proposal, sketch.parameters.fibre_spacing_um)) return accept(sketch, std::move(*proposal));
  }
  throw UsageError("no room for another " + std::string(name_of(type)) + " fibre after " +
                   std::to_string(sketch.fibres.size()) + ": ask for fewer, or a smaller fibre_spacing_um");
}

void draw_neighbour(Sketch& sketch, double tension_nN, Random& random) {
  const Polyline original = sketch.fibres.back().points_um;
  for (int i = 0; i < kMaxTries; ++i) {
    const double side = random.uniform() < 0.5 ? -1 : 1;
    // ends are staggered along the fibre, so that the adhesions have room beside each other
    const int from = random.below(static_cast<int>(original.size()) / 3);
    const int to = static_cast<int>(original.size()) - random.below(static_cast<int>(original.size()) / 3);
    Proposal proposal;
    for (int k = from; k < to; ++k) {
      proposal.points_um.push_back(original[k] +
                                   (side * sketch.parameters.pair_spacing_um) * left_of(tangent(original, k)));
    }
    hold(sketch, proposal, FibreType::ventral, tension_nN, random);
    // half a sampling step below the spacing: the neighbours' points need not lie abreast
    if (fits(sketch, proposal, 0.95 * sketch.parameters.pair_spacing_um)) return accept(sketch, std::move(proposal));
  }
  throw UsageError("no room beside fibre " + std::to_string(sketch.fibres.size()) + ": pair_spacing_um is too small");
}

}  // namespace mbtfm::drawing
