/// plan.csv, plan_needed.csv, plan_drawn.csv, plan_cells.csv.
#pragma once

#include <string>

#include "mbtfm/plan/cell_numbers.h"
#include "mbtfm/plan/drawn.h"
#include "pipeline/files/columns.h"

namespace mbtfm::plan {

files::Table<Expected> expected_table();
files::Table<Needed> needed_table();
files::Table<DrawnTension> drawn_table();
files::Table<CellNumbers> cell_table();

/// Their part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::plan
