/// What mbtfm-sheet writes of every run.
#pragma once

#include "mbtfm/sheet_stage/runs.h"

namespace mbtfm::sheet_stage {

/// sheet.csv, traction.csv, sheet.vtu. @returns points that lie outside
std::size_t write_solution(stage::StageContext& context, const Solution& solution);
/// borders.csv and cell_tension.csv. @returns means over all borders, by their length
Figures write_cells(stage::StageContext& context, const Solution& solution, const std::optional<double>& pixel_um);
Figures figures_of(const Solution& solution, const Balance& balance);
/// sheet.html
void write_page(stage::StageContext& context, const Run& done, const Balance& balance);

}  // namespace mbtfm::sheet_stage
