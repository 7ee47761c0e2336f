#include "samples/plan/tables.h"

namespace mbtfm::plan {

using files::kResult;
using files::member;
using files::Table;

namespace {

template <class Row>
files::Columns<Row> error_columns(const char* density) {
  return {{"youngs_modulus_kPa", member(&Row::point, &Point::youngs_modulus_kPa), kResult},
          {density, member(&Row::point, &Point::density), kResult},
          {"noise_um", member(&Row::point, &Point::noise_um), kResult},
          {"quantity", &Row::quantity},
          {"n", &Row::n},
          {"standard_error_nN", &Row::standard_error_nN, kResult},
          {"from_beads_nN", &Row::from_beads_nN, kResult}};
}

template <class Row>
files::Columns<Row> target_columns() {
  return {{"target_nN", &Row::target_nN, kResult},
          {"share_within", &Row::share_within, kResult},
          {"smallest_seen_nN", &Row::smallest_seen_nN, kResult}};
}

template <class Row>
files::Columns<Row> strain_columns() {
  return {{"largest_displacement_um", &Row::largest_displacement_um, kResult},
          {"beyond_linear", &Row::left_out, kResult}};
}

/// @param density  "beads_per_um2"
Table<Needed> needed_table(const char* file, const std::string& density) {
  using Row = Needed;
  return {.file = file,
          .columns = {{"youngs_modulus_kPa", &Row::youngs_modulus_kPa, kResult},
                      {"noise_um", &Row::noise_um, kResult},
                      {density, &Row::density, kResult},
                      {density + "_for_nine_in_ten", &Row::of_most, kResult}}};
}

files::Columns<DrawnNumber> drawn_columns() {
  using Row = DrawnNumber;
  return {{"true_nN", &Row::true_nN, kResult},
          {"found_nN", &Row::found_nN, kResult},
          {"predicted_error_nN", &Row::predicted_error_nN, kResult}};
}

}  // namespace

Table<Expected> expected_table(Quantity) {
  using Row = Expected;
  return {.file = "plan/plan.csv",
          .columns = {error_columns<Row>("beads_per_um2"),
                      {"from_mesh_nN", &Row::from_mesh_nN, kResult},
                      {"from_segmentation_nN", &Row::from_segmentation_nN, kResult},
                      {"from_other_nN", &Row::from_other_nN, kResult},
                      target_columns<Row>(),
                      {"least_distance_um", &Row::least_distance_um, kResult},
                      strain_columns<Row>()}};
}

Table<SpaceExpected> expected_table(SpaceQuantity) {
  using Row = SpaceExpected;
  return {.file = "plan/plan.csv of a cell in space",
          .columns = {error_columns<Row>("beads_per_um3"),
                      {"from_background_nN", &Row::from_background_nN, kResult},
                      target_columns<Row>(),
                      {"resolution_um", &Row::resolution_um, kResult},
                      {"least_distance_um", &Row::least_distance_um, kResult},
                      {"numbers_told", &Row::degrees, kResult},
                      strain_columns<Row>()}};
}

Table<Needed> needed_table(Quantity) { return needed_table("plan/plan_needed.csv", "beads_per_um2"); }

Table<Needed> needed_table(SpaceQuantity) {
  return needed_table("plan/plan_needed.csv of a cell in space", "beads_per_um3");
}

Table<DrawnNumber> drawn_table(Quantity) {
  using Row = DrawnNumber;
  return {.file = "plan/plan_drawn.csv",
          .columns = {{"experiment", &Row::experiment},
                      {"fibre_id", &Row::id},
                      drawn_columns(),
                      {"stated_error_nN", &Row::stated_error_nN, kResult}}};
}

Table<DrawnNumber> drawn_table(SpaceQuantity) {
  using Row = DrawnNumber;
  return {.file = "plan/plan_drawn.csv of a cell in space",
          .columns = {{"experiment", &Row::experiment},
                      {"adhesion_id", &Row::id},
                      {"component", &Row::component},
                      drawn_columns()}};
}

Table<CellNumbers> cell_table() {
  using Row = CellNumbers;
  files::Columns<Row> powers;
  for (std::size_t k = 0; k < std::size(kCells); ++k)
    powers.push_back(
        {"power_of_" + std::to_string(kCells[k]) + "_cells", [k](const Row& row) { return row.power.at(k); }, kResult});
  return {.file = "plan/plan_cells.csv",
          .columns = {{"type", member(&Row::scatter, &Scatter::type)},
                      {"mean_nN", member(&Row::scatter, &Scatter::mean_nN), kResult},
                      {"between_cells_nN", member(&Row::scatter, &Scatter::between_cells_nN), kResult},
                      {"within_nN", member(&Row::scatter, &Scatter::within_nN), kResult},
                      {"error_nN", member(&Row::scatter, &Scatter::error_nN), kResult},
                      {"source", member(&Row::scatter, &Scatter::source)},
                      {"difference", &Row::difference, kResult},
                      {"fibres_per_cell", &Row::fibres_per_cell, kResult},
                      {"cells", &Row::cells},
                      powers}};
}

std::string pages_of_tables() {
  return page_of(expected_table(Quantity{})) + page_of(needed_table(Quantity{})) + page_of(drawn_table(Quantity{})) +
         page_of(cell_table()) + page_of(expected_table(SpaceQuantity{})) + page_of(needed_table(SpaceQuantity{})) +
         page_of(drawn_table(SpaceQuantity{}));
}

}  // namespace mbtfm::plan
