/// plan.csv, plan_needed.csv, plan_drawn.csv of flat cells and of cells in space, plan_cells.csv.
#pragma once

#include "pipeline/files/columns.h"
#include "samples/plan/cell_numbers.h"

namespace mbtfm::plan {

files::Table<Expected> expected_table(Quantity);
files::Table<SpaceExpected> expected_table(SpaceQuantity);
files::Table<Needed> needed_table(Quantity);
files::Table<Needed> needed_table(SpaceQuantity);
files::Table<DrawnNumber> drawn_table(Quantity);
files::Table<DrawnNumber> drawn_table(SpaceQuantity);
files::Table<CellNumbers> cell_table();

/// Their part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::plan
