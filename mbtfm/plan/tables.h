/// plan.csv, plan_needed.csv, plan_drawn.csv, plan_cells.csv.
#pragma once

#include <string>

#include "mbtfm/plan/cell_numbers.h"
#include "mbtfm/plan/drawn.h"
#include "pipeline/files/columns.h"

namespace mbtfm::plan {

const files::Table<Expected>& expected_table();
const files::Table<Needed>& needed_table();
const files::Table<DrawnTension>& drawn_table();
const files::Table<CellNumbers>& cell_table();

/// Their part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::plan
