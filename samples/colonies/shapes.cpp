#include "samples/colonies/shapes.h"

#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "samples/drawing/geometry.h"

namespace mbtfm::colonies {
namespace {

using std::numbers::pi;

constexpr double kSpacing_um = 0.5;  // of an outline's points; where spikes bend, curves between them are 1 nm off

Polygon around(double size_um, double (*radius_um)(const ColonyParameters&, double), const ColonyParameters& p) {
  const int n = std::max(360, static_cast<int>(2 * pi * size_um / kSpacing_um));
  Polygon rim;
  for (int k = 0; k < n; ++k) {
    const double t = 2 * pi * k / n;
    rim.push_back(radius_um(p, t) * drawing::direction(t));
  }
  return rim;
}

/// w of the spikes' formula.
double spike_width(const ColonyParameters& p) {
  const double angle = p.spike_half_width_um / (p.radius_um + 0.5 * p.spike_um);
  return (1 - std::cos(p.n_spikes * angle)) / std::numbers::ln2;
}

/// The cells end a little beyond the bars; between these their edge is free.
Outline doublet(const ColonyParameters& p) {
  constexpr double kSkirt_um = 1.5, kCorner_um = 1.2;  // so that rounded corners still hold the pattern's
  if (p.bar_um >= p.pattern_um / 3)
    throw UsageError("[colony] bar_um: expected less than a third of pattern_um, so that an H is left");
  const double a = 0.5 * p.pattern_um, b = a - p.bar_um, c = 0.5 * p.bar_um, edge = a + kSkirt_um;
  const double inner = b - kSkirt_um, sag = p.sag * 2 * inner;
  if (edge - sag < c + kSkirt_um)
    throw UsageError("[colony] sag: the free edges would reach the middle bar; take less, or a larger pattern_um");
  Polygon rim;
  // turns from +x towards +y; the left of each chord is inside
  const auto add = [&](Vec2 from, Vec2 to, double inwards_um) {
    const Polyline side = drawing::parabola(from, to, inwards_um, kSpacing_um);
    rim.insert(rim.end(), side.begin(), side.end() - 1);
  };
  for (const double side : {1.0, -1.0}) {
    add(side * Vec2{-edge, -edge}, side * Vec2{-inner, -edge}, 0);
    add(side * Vec2{-inner, -edge}, side * Vec2{inner, -edge}, sag);
    add(side * Vec2{inner, -edge}, side * Vec2{edge, -edge}, 0);
    add(side * Vec2{edge, -edge}, side * Vec2{edge, edge}, 0);
  }
  rim = drawing::resampled_closed(drawing::smoothed_closed(drawing::resampled_closed(rim, kSpacing_um), kCorner_um),
                                  kSpacing_um);
  const Polygon h = {{-a, -a}, {-b, -a}, {-b, -c}, {b, -c}, {b, -a}, {a, -a},
                     {a, a},   {b, a},   {b, c},   {-b, c}, {-b, a}, {-a, a}};
  return {rim, {h}};
}

}  // namespace

Outline outline_of(const ColonyParameters& p) {
  if (p.shape == Shape::doublet_on_h) return doublet(p);
  if (p.shape == Shape::disc)
    return {around(
                p.radius_um, [](const ColonyParameters& of, double) { return of.radius_um; }, p),
            {}};
  if (p.n_spikes * p.spike_half_width_um > 0.5 * pi * p.radius_um)
    throw UsageError("[colony] the spikes run into each other: ask for fewer, or a smaller spike_half_width_um");
  const auto radius = [](const ColonyParameters& of, double t) {
    return of.radius_um + of.spike_um * std::exp((std::cos(of.n_spikes * t) - 1) / spike_width(of));
  };
  const double turn =
      2 * p.spike_um * p.n_spikes / p.radius_um;  // points are as close along a spike as around the disc
  const Polygon rim = around((p.radius_um + p.spike_um) * std::max(1.0, turn), radius, p);
  return {drawing::resampled_closed(rim, kSpacing_um), {}};
}

}  // namespace mbtfm::colonies
