#include "continuum/sheet/picture.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <map>

#include "continuum/sheet/elements.h"
#include "continuum/sheet/forward.h"
#include "continuum/sheet/recovery.h"
#include "pipeline/charts/chart.h"
#include "pipeline/charts/colour_map.h"
#include "pipeline/contract/extent.h"

namespace mbtfm::sheet {
namespace {

using charts::Chart;

Extent frame_of(const Elements& elements) {
  const auto [low, high] = extent_of(elements.triangles().nodes_um);
  const double rim = 0.04 * std::max(high.x - low.x, high.y - low.y);
  return {low - Vec2{rim, rim}, high + Vec2{rim, rim}};
}

Chart map_of(const std::string& title, const Extent& frame) {
  Chart map(title, {.label = "x (µm)", .low = frame.low_um.x, .high = frame.high_um.x},
            {.label = "y (µm)", .low = frame.high_um.y, .high = frame.low_um.y});
  map.same_scales();
  return map;
}

/// Squares of a lattice over the frame, by their middle.
void for_each_square(const Extent& frame, int most_across, const std::function<void(Vec2 middle, double half)>& body) {
  const Vec2 size = frame.high_um - frame.low_um;
  const double side = std::max(size.x, size.y) / most_across;
  for (double y = frame.low_um.y + 0.5 * side; y < frame.high_um.y; y += side)
    for (double x = frame.low_um.x + 0.5 * side; x < frame.high_um.x; x += side) body({x, y}, 0.5 * side);
}

/// Where a map's colours begin.
enum class Colours { from_least, from_zero };

/// Values at places of the sheet, in colours up to their largest.
void draw_values(Chart& map, const Solution& solution, const Extent& frame, const std::string& unit,
                 const std::function<double(const Locator::Place&, const Shape&)>& value_at,
                 Colours colours = Colours::from_least) {
  constexpr int kAcross = 80;
  struct Square {
    Vec2 middle;
    double half, value;
  };
  const Locator locator(*solution.elements);
  std::vector<Square> squares;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for_each_square(frame, kAcross, [&](Vec2 middle, double half) {
    const auto place = locator.find(middle, 0);
    if (!place) return;
    const double value = value_at(*place, solution.elements->shape(place->triangle, place->r, place->s));
    squares.push_back({middle, half, value});
    low = std::min(low, value);
    high = std::max(high, value);
  });
  if (colours == Colours::from_zero) low = std::min(low, 0.0);
  const double range = high > low ? high - low : 1;
  for (const Square& s : squares) {
    const std::string colour = charts::hex(charts::colour_at(charts::ColourMap::plasma, (s.value - low) / range));
    const Vec2 d{1.15 * s.half, 1.15 * s.half};  // no white lines between
    map.bar(s.middle - d, s.middle + d, "fill:" + colour + ";stroke:none");
  }
  map.put_key(Chart::KeySide::above);
  const std::vector<double> ticks = charts::ticks(low, low + range);
  const std::size_t step = ticks.size() > 3 ? 2 : 1;  // there is room for three
  for (std::size_t k = 0; k < ticks.size(); k += step)
    map.key(charts::readable(ticks[k]) + " " + unit,
            charts::hex(charts::colour_at(charts::ColourMap::plasma, (ticks[k] - low) / range)));
}

void draw_rims(Chart& map, const Solution& solution) {
  std::vector<std::pair<Vec2, Vec2>> pieces;
  const Triangles& triangles = solution.elements->triangles();
  for (const Triangles::Side& side : triangles.sides) {
    if (side.curve >= solution.sheet.n_rims) continue;
    const auto at = [&](int i) { return triangles.nodes_um[side.nodes[i]]; };
    pieces.emplace_back(at(0), at(2));
    pieces.emplace_back(at(2), at(1));
  }
  map.pieces(pieces, "stroke:#333;stroke-width:1;fill:none");
}

/// Means of the tractions over squares, the longest a square's side and a half.
void draw_tractions(Chart& map, const Solution& solution, const Extent& frame) {
  constexpr int kAcross = 18;
  const double side = std::max(frame.high_um.x - frame.low_um.x, frame.high_um.y - frame.low_um.y) / kAcross;
  struct Sum {
    Vec2 place, force;
    double area = 0;
  };
  std::map<std::pair<int, int>, Sum> sums;
  for (const GroundPatch& patch : solution.patches) {
    const Vec2 d = 1 / side * (patch.position_um - frame.low_um);
    Sum& sum = sums[{static_cast<int>(d.x), static_cast<int>(d.y)}];
    sum.place += patch.area_um2 * patch.position_um;
    sum.force += patch.area_um2 * patch.traction_kPa;
    sum.area += patch.area_um2;
  }
  double longest = 0;
  for (const auto& [square, sum] : sums) longest = std::max(longest, norm(sum.force) / sum.area);
  if (longest == 0) return;
  const double px_per_kPa = 1.5 * Chart::kFrameWidth_px / kAcross / longest;
  for (const char* style : {"stroke:#fff;stroke-width:3.4", "stroke:#111;stroke-width:1.4"})  // seen on any colour
    for (const auto& [square, sum] : sums)
      map.arrow(1 / sum.area * sum.place, px_per_kPa / sum.area * sum.force, style);
  map.subtitle("longest arrow: a mean of " + charts::readable(longest) + " kPa", "#555");
}

double mean_contraction_of(const Solution& solution, int triangle) {
  double sum = 0;
  for (int p = 0; p < Elements::kPoints; ++p)
    sum += solution.sheet.contraction_nN_per_um[Elements::kPoints * triangle + p];
  return sum / Elements::kPoints;
}

bool is_even(const std::vector<double>& values) {
  return std::ranges::all_of(values, [&](double value) { return value == values.front(); });
}

}  // namespace

std::string picture_of(const Solution& solution, const std::string& caption) {
  const Extent frame = frame_of(*solution.elements);
  Chart tension = map_of("Mean tension", frame), traction = map_of("Traction on the ground", frame);
  draw_values(tension, solution, frame, "nN/µm", [&](const Locator::Place& place, const Shape& shape) {
    return mean_of(value_of(solution.at_nodes, solution.elements->nodes(place.triangle), shape));
  });
  draw_values(traction, solution, frame, "kPa", [&](const Locator::Place& place, const Shape&) {
    return norm(solution.patches[place.triangle].traction_kPa);
  });
  draw_rims(tension, solution);
  draw_rims(traction, solution);
  draw_tractions(traction, solution, frame);
  if (is_even(solution.sheet.contraction_nN_per_um)) return charts::svg_file({tension, traction}, 2, {caption});
  Chart contraction = map_of("Contraction", frame);
  // from zero: differences that mean nothing have hardly another colour
  draw_values(
      contraction, solution, frame, "nN/µm",
      [&](const Locator::Place& place, const Shape&) { return mean_contraction_of(solution, place.triangle); },
      Colours::from_zero);
  draw_rims(contraction, solution);
  return charts::svg_file({tension, traction, contraction}, 3, {caption});
}

}  // namespace mbtfm::sheet
