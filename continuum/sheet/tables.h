/// Files of a sheet.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/contract/path.h"

namespace mbtfm::sheet {

struct Solution;

/// A place of the sheet; empty values where the sheet is not.
struct SheetPoint {
  Vec2 position_um;
  std::optional<double> ux_um{}, uy_um{};
  std::optional<double> sxx_nN_per_um{}, syy_nN_per_um{}, sxy_nN_per_um{};
  std::optional<double> mean_tension_nN_per_um{}, max_shear_nN_per_um{};
  std::optional<double> mean_tension_sigma_nN_per_um{};
};
std::vector<SheetPoint> at_nodes_of(const Solution& solution);
std::vector<SheetPoint> at_points_of(const Solution& solution, const std::vector<Vec2>& points_um);

void write_sheet(const Path& file, const std::vector<SheetPoint>& points);
/// Quadratic triangles with displacement and tensions at the nodes, traction by triangle.
void write_sheet_vtu(const Path& file, const Solution& solution);
/// Their part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::sheet
