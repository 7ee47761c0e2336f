#include "continuum/sheet/borders.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "continuum/sheet/elements.h"
#include "continuum/sheet/forward.h"
#include "continuum/sheet/recovery.h"
#include "pipeline/files/columns.h"
#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::sheet {
namespace {

/// A side between two pixels of different cells.
struct PixelSide {
  Vec2 place_um;
  bool is_upright = false;  ///< its normal is x
};
using Pair = std::pair<int, int>;

std::map<Pair, std::vector<PixelSide>> sides_by_pair(const CellLabels& cells) {
  std::map<Pair, std::vector<PixelSide>> sides;
  const auto look = [&](int a, int b, Vec2 at_px, bool is_upright) {
    if (a == b || a == 0 || b == 0) return;
    sides[std::minmax(a, b)].push_back({cells.pixel_um * at_px, is_upright});
  };
  for (int row = 0; row < cells.height; ++row)
    for (int column = 0; column < cells.width; ++column) {
      const int here = cells.at(column, row);
      if (column + 1 < cells.width) look(here, cells.at(column + 1, row), {column + 1.0, row + 0.5}, true);
      if (row + 1 < cells.height) look(here, cells.at(column, row + 1), {column + 0.5, row + 1.0}, false);
    }
  return sides;
}

/// The border's direction at each of its sides: of the sides within so far of it, along which they spread most.
std::vector<Vec2> directions(const std::vector<PixelSide>& sides, double reach_um) {
  std::vector<Vec2> places;
  for (const PixelSide& side : sides) places.push_back(side.place_um);
  numerics::Grid grid(places, reach_um);
  for (std::size_t k = 0; k < places.size(); ++k) grid.add(static_cast<int>(k), places[k], places[k]);
  std::vector<Vec2> along;
  for (const Vec2 at : places) {
    Vec2 mean;
    double n = 0, xx = 0, yy = 0, xy = 0;
    grid.for_each_near(at, at, reach_um, [&](int k) {
      const Vec2 d = places[k] - at;
      if (dot(d, d) > reach_um * reach_um) return;
      mean += d;
      xx += d.x * d.x;
      yy += d.y * d.y;
      xy += d.x * d.y;
      ++n;
    });
    const double angle =
        0.5 * std::atan2(2 * (xy - mean.x * mean.y / n), xx - yy - (mean.x * mean.x - mean.y * mean.y) / n);
    along.push_back({std::cos(angle), std::sin(angle)});
  }
  return along;
}

files::Table<Border> border_table() {
  using Row = Border;
  return {.file = "borders.csv",
          .columns = {{"cell_a", &Row::cell_a},
                      {"cell_b", &Row::cell_b},
                      {"length_um", &Row::length_um, files::kResult},
                      {"normal_nN_per_um", &Row::normal_nN_per_um, files::kResult},
                      {"shear_nN_per_um", &Row::shear_nN_per_um, files::kResult},
                      {"magnitude_nN_per_um", &Row::magnitude_nN_per_um, files::kResult}}};
}

files::Table<CellTension> cell_table() {
  using Row = CellTension;
  return {.file = "cell_tension.csv",
          .columns = {{"cell", &Row::cell},
                      {"area_um2", &Row::area_um2, files::kResult},
                      {"mean_tension_nN_per_um", &Row::mean_tension_nN_per_um, files::kResult},
                      {"max_shear_nN_per_um", &Row::max_shear_nN_per_um, files::kResult}}};
}

}  // namespace

CellLabels with_lines_filled(CellLabels cells, int widest_px) {
  const int reach = (widest_px + 1) / 2;
  for (int step = 0; step < reach; ++step) {
    std::vector<int> next = cells.labels;
    for (int row = 0; row < cells.height; ++row)
      for (int column = 0; column < cells.width; ++column) {
        if (cells.at(column, row) != 0) continue;
        for (const auto& [i, j] :
             {std::pair{column - 1, row}, {column + 1, row}, {column, row - 1}, {column, row + 1}}) {
          if (i < 0 || j < 0 || i >= cells.width || j >= cells.height || cells.at(i, j) == 0) continue;
          next[static_cast<std::size_t>(row) * cells.width + column] = cells.at(i, j);
          break;
        }
      }
    cells.labels = std::move(next);
  }
  return cells;
}

std::vector<Border> borders_of(const CellLabels& cells, const Solution& solution, double shortest_um) {
  constexpr double kReach_px = 8;  // steps of a pixel then turn the direction by a few degrees at most
  const Locator locator(*solution.elements);
  std::vector<Border> borders;
  for (const auto& [pair, sides] : sides_by_pair(cells)) {
    const std::vector<Vec2> along = directions(sides, kReach_px * cells.pixel_um);
    Border border{.cell_a = pair.first, .cell_b = pair.second};
    for (std::size_t k = 0; k < sides.size(); ++k) {
      const Vec2 t = along[k], n{-t.y, t.x};
      const double length = cells.pixel_um * std::abs(sides[k].is_upright ? n.x : n.y);
      const auto place = locator.find(sides[k].place_um);
      if (!place) continue;
      const Tensor S = value_of(solution.at_nodes, solution.elements->nodes(place->triangle),
                                solution.elements->shape(place->triangle, place->r, place->s));
      const Vec2 pull{S.xx * n.x + S.xy * n.y, S.xy * n.x + S.yy * n.y};
      border.length_um += length;
      border.normal_nN_per_um += length * dot(n, pull);
      border.shear_nN_per_um += length * std::abs(dot(t, pull));
      border.magnitude_nN_per_um += length * norm(pull);
    }
    if (border.length_um < shortest_um || border.length_um == 0) continue;
    for (double* sum : {&border.normal_nN_per_um, &border.shear_nN_per_um, &border.magnitude_nN_per_um})
      *sum /= border.length_um;
    borders.push_back(border);
  }
  return borders;
}

std::vector<CellTension> cell_tensions(const CellLabels& cells, const Solution& solution) {
  std::map<int, CellTension> by_label;
  solution.elements->for_each_point([&](int t, int p, const Shape& shape) {
    const Vec2 at = 1 / cells.pixel_um * shape.place_um;
    if (!(at.x >= 0 && at.y >= 0 && at.x < cells.width && at.y < cells.height)) return;
    const int label = cells.at(static_cast<int>(at.x), static_cast<int>(at.y));
    if (label == 0) return;
    const Tensor& S = solution.at_points[Elements::kPoints * t + p];
    CellTension& cell = by_label[label];
    cell.cell = label;
    cell.area_um2 += shape.weight_um2;
    cell.mean_tension_nN_per_um += shape.weight_um2 * mean_of(S);
    cell.max_shear_nN_per_um += shape.weight_um2 * largest_shear(S);
  });
  std::vector<CellTension> result;
  for (auto& [label, cell] : by_label) {
    cell.mean_tension_nN_per_um /= cell.area_um2;
    cell.max_shear_nN_per_um /= cell.area_um2;
    result.push_back(cell);
  }
  return result;
}

void write_borders(const Path& file, const std::vector<Border>& borders) {
  files::write(file, border_table(), borders);
}
void write_cell_tensions(const Path& file, const std::vector<CellTension>& cells) {
  files::write(file, cell_table(), cells);
}
std::string pages_of_cells() { return page_of(border_table()) + page_of(cell_table()); }

}  // namespace mbtfm::sheet
