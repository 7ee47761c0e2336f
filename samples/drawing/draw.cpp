#include "samples/drawing/draw.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "pipeline/contract/errors.h"
#include "samples/drawing/geometry.h"
#include "samples/drawing/random.h"
#include "samples/drawing/sketch.h"

namespace mbtfm::drawing {

namespace {

LogNormal tension_distribution(const TensionParameters& p, FibreType type) {
  const double low = p.smallest_tension_nN, high = p.largest_tension_nN;
  if (type == FibreType::dorsal) return {p.dorsal_median_nN, p.dorsal_log_sd, low, high};
  if (type == FibreType::arc) return {p.arc_median_nN, p.arc_log_sd, low, high};
  return {p.ventral_median_nN, p.ventral_log_sd, low, high};
}

/// Fibres and adhesions at random. Ventral fibres first: they are the longest and need the most room.
std::vector<double> draw_spread(Sketch& sketch, const TensionParameters& tension, std::uint64_t seed) {
  Random outline(seed, Stream::outline), tensions(seed, Stream::tensions), fibres(seed, Stream::fibres),
      adhesions(seed, Stream::adhesions);
  draw_outline(sketch, outline);
  const CellParameters& p = sketch.parameters;
  std::vector<double> drawn;
  const auto next = [&](FibreType type) {
    return drawn.emplace_back(draw(tensions, tension_distribution(tension, type)));
  };
  for (int i = 0; i < p.n_ventral; ++i) {
    draw_fibre(sketch, FibreType::ventral, next(FibreType::ventral), fibres);
    if (i < p.n_pairs) draw_neighbour(sketch, next(FibreType::ventral), fibres);
  }
  for (int i = 0; i < p.n_dorsal; ++i) draw_fibre(sketch, FibreType::dorsal, next(FibreType::dorsal), fibres);
  for (int i = 0; i < p.n_arc; ++i) draw_fibre(sketch, FibreType::arc, next(FibreType::arc), fibres);
  draw_free_adhesions(sketch, adhesions);
  return drawn;
}

std::vector<double> draw_dense(Sketch& sketch, const TensionParameters& tension, std::uint64_t seed) {
  Random outline(seed, Stream::outline), tensions(seed, Stream::tensions), fibres(seed, Stream::fibres),
      adhesions(seed, Stream::adhesions);
  draw_outline(sketch, outline);
  const auto next = [&](FibreType type) { return draw(tensions, tension_distribution(tension, type)); };
  std::vector<double> drawn = draw_dense_fibres(sketch, next, fibres);
  draw_free_adhesions(sketch, adhesions);
  return drawn;
}

/// Brightness of adhesions and fibres, width of fibres.
void draw_brightness(Sketch& sketch, std::uint64_t seed) {
  Random random(seed, Stream::specimen);
  const double log_sd = sketch.parameters.brightness_log_sd;
  const LogNormal brightness{
      .median = 1, .log_sd = log_sd, .low = std::min(0.5, 1 - log_sd), .high = std::max(2.0, 1 + 2 * log_sd)};
  for (Adhesion& a : sketch.adhesions) a.mean_intensity = draw(random, brightness);
  for (Fibre& f : sketch.fibres) f.mean_intensity = draw(random, brightness);
  for (Fibre& f : sketch.fibres) f.width_um *= std::exp(sketch.parameters.fibre_width_log_sd * random.normal());
}

void check_field(const Sketch& sketch, double field_um) {
  for (const Vec2 p : sketch.outline_um) {
    if (std::min({p.x, p.y, field_um - p.x, field_um - p.y}) < 0) {
      throw UsageError("the cell reaches beyond the field of " + std::to_string(field_um) +
                       " um: ask for a smaller diameter_um or a larger image_size_px");
    }
  }
}

}  // namespace

DrawnCell draw_cell(const CellParameters& parameters, const TensionParameters& tension, double field_um,
                    std::uint64_t seed) {
  Sketch sketch;
  sketch.parameters = parameters;
  sketch.centre_um = {0.5 * field_um, 0.5 * field_um};
  DrawnCell drawn;
  if (parameters.layout == Layout::spread) {
    drawn.tensions_nN = draw_spread(sketch, tension, seed);
  } else if (parameters.layout == Layout::dense) {
    drawn.tensions_nN = draw_dense(sketch, tension, seed);
  } else if (parameters.layout == Layout::ring) {
    draw_ring(sketch);
    drawn.tensions_nN.assign(sketch.fibres.size(), tension.dorsal_median_nN);
  } else {
    draw_line(sketch);
    drawn.tensions_nN.assign(sketch.fibres.size(), tension.ventral_median_nN);
  }
  draw_brightness(sketch, seed);
  check_field(sketch, field_um);
  for (Fibre& f : sketch.fibres) f.points_um = resampled(f.points_um, kPointSpacing_um);
  drawn.cell = {std::move(sketch.adhesions), std::move(sketch.fibres), std::move(sketch.outline_um), {}};
  check(drawn.cell);
  return drawn;
}

}  // namespace mbtfm::drawing
