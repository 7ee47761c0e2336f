#include "samples/drawing/faults.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::drawing {
namespace {

/// In the field, farther from the outline than this.
Vec2 place_beside(const Cell& cell, double clearance_um, double field_um, Random& random) {
  constexpr int kMostTries = 10000;
  for (int i = 0; i < kMostTries; ++i) {
    const double x = random.uniform(0, field_um);
    const Vec2 place{x, random.uniform(0, field_um)};
    if (!contains(cell.outline_um, place) && distance_to_boundary_um(cell.outline_um, place) > clearance_um)
      return place;
  }
  throw UsageError("there is no room for debris beside the cell: choose a larger field");
}

}  // namespace

void declare(stage::ParameterList& list, FaultParameters& p) {
  list.add("n_specks", p.n_specks, Range::between(0, 1000));
  list.add("speck_brightness", p.speck_brightness, Range::factor());
  list.add("n_dead_cells", p.n_dead_cells, Range::between(0, 100));
  list.add("relaxed_defocus", p.relaxed_defocus, Range::between(1, 10));
  list.add("stressed_defocus", p.stressed_defocus, Range::between(1, 10));
  list.add("light_lost", p.light_lost, Range::between(0, 0.95));
  list.add("saturated", p.saturated, Range::between(0, 0.5));
  list.add("padding_px", p.padding_px, Range::between(0, 8192));
  list.add("scale_bar_px", p.scale_bar_px, Range::between(0, 8192));
  list.add("n_hot_pixels", p.n_hot_pixels, Range::between(0, 100000));
}

void add_debris(const Cell& cell, const FaultParameters& f, std::uint64_t seed, images::Image& paxillin,
                images::Image& actin) {
  constexpr double kDeadRadius_um = 8, kDeadBrightness = 1.5;  // of a rounded cell; as it is thicker than a spread one
  const double px = *paxillin.pixel_size_um, field_um = px * paxillin.width;
  Random random(seed, Stream::faults);
  for (int i = 0; i < f.n_specks; ++i) {
    const double sigma_um = random.uniform(0.4, 0.9);  // 1 to 2 um wide
    const Vec2 place = place_beside(cell, 3 * sigma_um, field_um, random);
    const double area_px = 2 * std::numbers::pi * sigma_um * sigma_um / (px * px);
    add_spot(random.below(2) == 0 ? paxillin : actin, {place, f.speck_brightness * area_px, sigma_um});
  }
  for (int i = 0; i < f.n_dead_cells; ++i) {
    Adhesion round;
    round.position_um = place_beside(cell, kDeadRadius_um, field_um, random);
    round.major_axis_um = round.minor_axis_um = 2 * kDeadRadius_um;
    add_ellipse(paxillin, round, kDeadBrightness, 1, 0);
    add_ellipse(actin, round, kDeadBrightness, 1, 0);
  }
}

void add_hot_pixels(int n_hot_pixels, std::uint64_t seed, images::Image& counts) {
  Random random(seed, Stream::faults, 1);
  for (int i = 0; i < n_hot_pixels; ++i) {
    const int column = random.below(counts.width), row = random.below(counts.height);
    counts.at(column, row) = 65535;
  }
}

void spoil(const FaultParameters& f, images::Image& counts) {
  if (f.saturated > 0) {
    std::vector<float> sorted = counts.pixels;
    const auto end = sorted.begin() + std::lround((1 - f.saturated) * static_cast<double>(sorted.size() - 1));
    std::ranges::nth_element(sorted, end);
    for (float& value : counts.pixels) value = std::min(value, *end);
  }
  const float largest = *std::ranges::max_element(counts.pixels);
  constexpr double kTurn = 0.0175;  // a degree, as registration turns a picture
  for (int row = 0; row < counts.height; ++row)
    for (int column = 0; column < counts.width; ++column)
      if (f.padding_px > 0 && (row < f.padding_px - kTurn * column || column < f.padding_px + kTurn * row))
        counts.at(column, row) = 0;
  constexpr int kMargin_px = 20, kBar_px = 8;
  for (int row = counts.height - kMargin_px - kBar_px; row < counts.height - kMargin_px; ++row)
    for (int column = counts.width - kMargin_px - f.scale_bar_px; column < counts.width - kMargin_px; ++column)
      if (row >= 0 && column >= 0) counts.at(column, row) = largest;
}

}  // namespace mbtfm::drawing
