/// Tensions between the cells of a sheet, and in each of them.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/contract/path.h"

namespace mbtfm::sheet {

struct Solution;

/// Which cell each pixel belongs to; 0: none. Row by row from the top.
struct CellLabels {
  int width = 0, height = 0;
  double pixel_um = 1;
  std::vector<int> labels;
  int at(int column, int row) const { return labels[static_cast<std::size_t>(row) * width + column]; }
  /// 0 outside of the image.
  int at_um(Vec2 place_um) const {
    const double column = std::floor(place_um.x / pixel_um), row = std::floor(place_um.y / pixel_um);
    const bool is_seen = column >= 0 && row >= 0 && column < width && row < height;
    return is_seen ? at(static_cast<int>(column), static_cast<int>(row)) : 0;
  }
};

/// With the lines between cells, as masks often draw them, given to the nearest cell. @param widest_px  that is a line
CellLabels with_lines_filled(CellLabels cells, int widest_px);

/// Force across the border of two cells, per length of it.
struct Border {
  int cell_a = 0, cell_b = 0;  ///< a < b
  double length_um = 0;
  double normal_nN_per_um = 0;     ///< n · S n, mean over the border; > 0 pulls
  double shear_nN_per_um = 0;      ///< |t · S n|
  double magnitude_nN_per_um = 0;  ///< |S n|
};
/// Borders shorter than `shortest_um` are left out: their direction is not known.
std::vector<Border> borders_of(const CellLabels& cells, const Solution& solution, double shortest_um);

struct CellTension {
  int cell = 0;
  double area_um2 = 0;
  double mean_tension_nN_per_um = 0, max_shear_nN_per_um = 0;  ///< means over the cell
};
std::vector<CellTension> cell_tensions(const CellLabels& cells, const Solution& solution);

void write_borders(const Path& file, const std::vector<Border>& borders);
void write_cell_tensions(const Path& file, const std::vector<CellTension>& cells);
/// Their part of docs/columns.md.
std::string pages_of_cells();

}  // namespace mbtfm::sheet
