#include <algorithm>
#include <cmath>
#include <string>

#include "pipeline/contract/errors.h"
#include "samples/drawing/geometry.h"
#include "samples/drawing/sketch.h"

namespace mbtfm::drawing {

namespace {

/// Least distance from an adhesion's rim to the outline.
constexpr double kRim_um = 0.2;
/// Adhesions nearer to a fibre than this align with it.
constexpr double kAlignedDistance_um = 5;
constexpr double kAreaLogSd = 0.6;          // areas spread over a decade
constexpr double kPeripheral = 0.75;        // share of the adhesions without a fibre that lie along the outline …
constexpr double kPeripheralBand_um = 3.5;  // … within this band

LogNormal area_distribution(const Sketch& sketch) {
  const CellParameters& p = sketch.parameters;
  return {p.adhesion_area_um2, kAreaLogSd, p.smallest_area_um2, p.largest_area_um2};
}

/// Areas of the adhesions without a fibre: what is left of the mean after those with one.
LogNormal free_area_distribution(const Sketch& sketch) {
  const CellParameters& p = sketch.parameters;
  double taken = 0;
  for (const Adhesion& a : sketch.adhesions) taken += a.area_um2;
  const int n_left = p.n_adhesions - static_cast<int>(sketch.adhesions.size());
  const double left = (p.adhesion_area_um2 * p.n_adhesions - taken) / n_left;
  // strong fibres may have taken so much that the rest cannot make up for it
  return with_mean(area_distribution(sketch), std::max(left, 2 * p.smallest_area_um2));
}

/// The direction of the nearest fibre within reach.
std::optional<double> fibre_angle_near(const Sketch& sketch, Vec2 point) {
  double nearest = kAlignedDistance_um;
  std::optional<double> angle;
  for (const Fibre& f : sketch.fibres) {
    for (std::size_t i = 0; i < f.points_um.size(); ++i) {
      const double distance = norm(f.points_um[i] - point);
      if (distance >= nearest) continue;
      nearest = distance;
      const Vec2 along = tangent(f.points_um, i);
      angle = std::atan2(along.y, along.x);
    }
  }
  return angle;
}

Adhesion propose_peripheral(const Sketch& sketch, double area, double aspect, Random& random) {
  const int n = static_cast<int>(sketch.outline_um.size());
  int boundary = random.below(n);
  if (random.uniform() < 0.35) {  // corners are rich in adhesions
    const int corner = sketch.corner_points[random.below(static_cast<int>(sketch.corner_points.size()))];
    boundary = ((corner + static_cast<int>(std::lround(5 / kOutlineSpacing_um * random.normal()))) % n + n) % n;
  }
  const Vec2 inward = inward_normal(sketch, boundary);
  const Vec2 position = sketch.outline_um[boundary] + random.uniform(0.5, kPeripheralBand_um) * inward;
  const Vec2 to_centre = unit(sketch.centre_um - position);
  const Vec2 pointing = unit(inward + to_centre);
  return make_adhesion(position, area, aspect, std::atan2(pointing.y, pointing.x) + 0.25 * random.normal());
}

Adhesion propose_central(const Sketch& sketch, double area, double aspect, Random& random) {
  const double reach = 0.75 * sketch.parameters.diameter_um;
  const Vec2 position = sketch.centre_um + Vec2{random.uniform(-reach, reach), random.uniform(-reach, reach)};
  const Vec2 to_centre = sketch.centre_um - position;
  const double angle = fibre_angle_near(sketch, position).value_or(std::atan2(to_centre.y, to_centre.x));
  return make_adhesion(position, area, aspect, angle + 0.3 * random.normal());
}

}  // namespace

bool has_room(const Sketch& sketch, const Adhesion& adhesion) {
  const CellParameters& p = sketch.parameters;
  for (const Adhesion& other : sketch.adhesions)
    if (too_near(adhesion, other, p.adhesion_clearance_um)) return false;
  for (const Fibre& f : sketch.fibres) {
    const double margin = 0.5 * f.width_um + p.adhesion_clearance_um;
    if (std::ranges::any_of(f.points_um, [&](Vec2 q) { return covers(adhesion, q, margin); })) return false;
    const double end_margin = p.free_end_clearance_um;
    if (!f.start_adhesion_id && covers(adhesion, f.points_um.front(), end_margin)) return false;
    if (!f.end_adhesion_id && covers(adhesion, f.points_um.back(), end_margin)) return false;
  }
  for (const Vec2 point : ellipse_corners(adhesion, 24, kRim_um))
    if (!contains(sketch.outline_um, point)) return false;
  return true;
}

void draw_free_adhesions(Sketch& sketch, Random& random) {
  const CellParameters& p = sketch.parameters;
  const int n_held = static_cast<int>(sketch.adhesions.size());
  if (n_held >= p.n_adhesions) return;
  const LogNormal areas = free_area_distribution(sketch);
  for (int i = n_held; i < p.n_adhesions; ++i) {
    const bool is_peripheral = random.uniform() < kPeripheral;
    const double area = draw(random, areas);
    const double aspect = random.uniform(p.smallest_aspect, p.largest_aspect);
    Adhesion adhesion;
    int tries = 0;
    do {
      if (++tries > kMaxTries) {
        throw UsageError("no room for adhesion " + std::to_string(i + 1) + " of " + std::to_string(p.n_adhesions) +
                         ": ask for fewer, smaller ones or a larger cell");
      }
      adhesion = is_peripheral ? propose_peripheral(sketch, area, aspect, random)
                               : propose_central(sketch, area, aspect, random);
    } while (!has_room(sketch, adhesion));
    adhesion.adhesion_id = i + 1;
    sketch.adhesions.push_back(adhesion);
  }
}

}  // namespace mbtfm::drawing
