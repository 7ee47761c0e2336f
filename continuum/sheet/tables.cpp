#include "continuum/sheet/tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ranges>

#include "continuum/sheet/elements.h"
#include "continuum/sheet/forward.h"
#include "continuum/sheet/recovery.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/vtk_files.h"

namespace mbtfm::sheet {
namespace {

files::Table<SheetPoint> sheet_table() {
  using Row = SheetPoint;
  return {.file = "sheet.csv",
          .columns = {{"x_um", files::x_of(&Row::position_um)},
                      {"y_um", files::y_of(&Row::position_um)},
                      {"ux_um", &Row::ux_um},
                      {"uy_um", &Row::uy_um},
                      {"sxx_nN_per_um", &Row::sxx_nN_per_um},
                      {"syy_nN_per_um", &Row::syy_nN_per_um},
                      {"sxy_nN_per_um", &Row::sxy_nN_per_um},
                      {"mean_tension_nN_per_um", &Row::mean_tension_nN_per_um},
                      {"max_shear_nN_per_um", &Row::max_shear_nN_per_um},
                      {"mean_tension_sigma_nN_per_um", &Row::mean_tension_sigma_nN_per_um}}};
}

SheetPoint row_of(Vec2 place, Vec2 u, const Tensor& S) {
  return {place, u.x, u.y, S.xx, S.yy, S.xy, mean_of(S), largest_shear(S), std::nullopt};
}

}  // namespace

std::vector<SheetPoint> at_nodes_of(const Solution& solution) {
  const Elements& elements = *solution.elements;
  std::vector<SheetPoint> rows;
  for (int i = 0; i < elements.n_nodes(); ++i)
    rows.push_back(row_of(elements.triangles().nodes_um[i], at_node(solution.u, i), solution.at_nodes[i]));
  if (solution.sigma_by_triangle.empty()) return rows;
  for (int t = 0; t < elements.n_triangles(); ++t)
    for (const int node : elements.nodes(t)) {
      std::optional<double>& sigma = rows[node].mean_tension_sigma_nN_per_um;
      sigma = std::max(sigma.value_or(0), solution.sigma_by_triangle[t]);
    }
  return rows;
}

std::vector<SheetPoint> at_points_of(const Solution& solution, const std::vector<Vec2>& points_um) {
  const Locator locator(*solution.elements);
  std::vector<SheetPoint> rows;
  for (const Vec2 p : points_um) {
    const auto place = locator.find(p);
    if (!place) {
      rows.push_back({.position_um = p});
      continue;
    }
    const Shape shape = solution.elements->shape(place->triangle, place->r, place->s);
    const auto& nodes = solution.elements->nodes(place->triangle);
    rows.push_back(row_of(p, value_of(solution.u, nodes, shape), value_of(solution.at_nodes, nodes, shape)));
    if (!solution.sigma_by_triangle.empty())
      rows.back().mean_tension_sigma_nN_per_um = solution.sigma_by_triangle[place->triangle];
  }
  return rows;
}

void write_sheet(const Path& file, const std::vector<SheetPoint>& points) { files::write(file, sheet_table(), points); }

void write_sheet_vtu(const Path& file, const Solution& solution) {
  const Elements& elements = *solution.elements;
  files::Grid grid{.corners = 6, .points_um = {}, .cells = {}, .point_arrays = {}, .cell_arrays = {}};
  for (const Vec2 node : elements.triangles().nodes_um) grid.points_um.push_back({node.x, node.y, 0});
  for (int t = 0; t < elements.n_triangles(); ++t)
    grid.cells.insert(grid.cells.end(), elements.nodes(t).begin(), elements.nodes(t).end());
  const auto axis = [](const Tensor& s) {
    const double angle = 0.5 * std::atan2(2 * s.xy, s.xx - s.yy);
    return Vec2{std::cos(angle), std::sin(angle)};
  };
  grid.point_arrays = {files::array_of("displacement_um", std::views::iota(0, elements.n_nodes()),
                                       [&](int node) { return at_node(solution.u, node); }),
                       files::array_of("tension_nN_per_um", solution.at_nodes,
                                       [](const Tensor& s) {
                                         return std::array{s.xx, s.yy, s.xy};
                                       }),
                       files::array_of("mean_tension_nN_per_um", solution.at_nodes, mean_of),
                       files::array_of("max_shear_nN_per_um", solution.at_nodes, largest_shear),
                       files::array_of("largest_tension_axis", solution.at_nodes, axis)};
  grid.cell_arrays = {files::array_of("traction_kPa", solution.patches, &GroundPatch::traction_kPa),
                      files::array_of("ground_displacement_um", solution.patches, &GroundPatch::displacement_um)};
  files::write_grid_vtu(file, grid);
}

std::string pages_of_tables() { return page_of(sheet_table()); }

}  // namespace mbtfm::sheet
