#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "samples/drawing/geometry.h"
#include "samples/drawing/sketch.h"

namespace mbtfm::drawing {

namespace {

/// Width of the cytoplasm around a regular cell's adhesions.
constexpr double kSkirt_um = 1.5;

Adhesion regular_adhesion(const CellParameters& p, Vec2 position_um, double angle_rad) {
  return make_adhesion(position_um, p.adhesion_area_um2, 0.5 * (p.smallest_aspect + p.largest_aspect), angle_rad);
}

}  // namespace

void draw_line(Sketch& sketch) {
  const CellParameters& p = sketch.parameters;
  const Vec2 half{0.5 * p.diameter_um, 0};
  const Adhesion left = regular_adhesion(p, sketch.centre_um - half, 0);
  const Adhesion right = regular_adhesion(p, sketch.centre_um + half, 0);
  add_fibre(sketch, resampled({left.position_um, right.position_um}, kFibreSpacing_um), &left, &right);
  // a spindle around the two: an ellipse that clears their far rims
  const double reach = 0.5 * (p.diameter_um + left.major_axis_um) + kSkirt_um;
  Adhesion spindle;
  spindle.position_um = sketch.centre_um;
  spindle.major_axis_um = 2 * reach;
  spindle.minor_axis_um = 2 * reach / p.elongation;
  sketch.outline_um = resampled_closed(ellipse_corners(spindle, 720), kOutlineSpacing_um);
}

void draw_ring(Sketch& sketch) {
  const CellParameters& p = sketch.parameters;
  const double radius = 0.5 * p.diameter_um;
  Adhesion disc;
  disc.position_um = sketch.centre_um;
  disc.major_axis_um = disc.minor_axis_um = 2 * (radius + 2 * kSkirt_um);
  sketch.outline_um = resampled_closed(ellipse_corners(disc, 720), kOutlineSpacing_um);
  for (int i = 0; i < p.n_adhesions; ++i) {
    const Vec2 outward = direction(2 * std::numbers::pi * i / p.n_adhesions);
    Adhesion adhesion = regular_adhesion(p, sketch.centre_um + radius * outward, std::atan2(outward.y, outward.x));
    const bool is_crowded = std::ranges::any_of(
        sketch.adhesions, [&](const Adhesion& a) { return too_near(a, adhesion, p.adhesion_clearance_um); });
    if (is_crowded) throw UsageError("the adhesions of the ring touch: ask for fewer, or a larger diameter_um");
    // fibre k starts at adhesion k·n/n_dorsal: evenly spread where n_dorsal divides n
    if (i * p.n_dorsal / p.n_adhesions != (i - 1) * p.n_dorsal / p.n_adhesions || (i == 0 && p.n_dorsal > 0)) {
      const Vec2 inner = sketch.centre_um + (0.5 * radius) * outward;
      add_fibre(sketch, resampled({adhesion.position_um, inner}, kFibreSpacing_um), &adhesion, nullptr);
    } else {
      adhesion.adhesion_id = static_cast<int>(sketch.adhesions.size()) + 1;
      sketch.adhesions.push_back(adhesion);
    }
  }
}

}  // namespace mbtfm::drawing
