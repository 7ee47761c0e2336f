#include "mbtfm/plan/tables.h"

#include <cmath>

#include "mbtfm/plan/space_answer.h"

namespace mbtfm::plan {

using files::kResult;
using files::member;
using files::Table;

Table<Expected> expected_table() {
  using Row = Expected;
  return {
      .file = "plan/plan.csv",
      .row = "each gel, density, noise and quantity",
      .columns = {
          {"youngs_modulus_kPa", "of the gel", member(&Row::point, &Point::youngs_modulus_kPa), kResult},
          {"beads_per_um2", "beads by area", member(&Row::point, &Point::beads_per_um2), kResult},
          {"noise_um", "standard deviation of a displacement component", member(&Row::point, &Point::noise_um),
           kResult},
          {"quantity", "what is estimated; `adhesion force alone`: by the method adhesion-forces, without a network",
           &Row::quantity},
          {"n", "how many of them the cell has; of several, the numbers are medians", &Row::n},
          {"standard_error_nN", "expected, by beads and model together", &Row::standard_error_nN, kResult},
          {"from_beads_nN", "by the noise of the beads: the Cramér–Rao bound", &Row::from_beads_nN, kResult},
          {"from_mesh_nN", "by the mesh of the network", &Row::from_mesh_nN, kResult},
          {"from_segmentation_nN", "by the segmentation", &Row::from_segmentation_nN, kResult},
          {"from_other_nN", "by the rest of the model's misfit", &Row::from_other_nN, kResult},
          {"target_nN", "standard error that is asked for", &Row::target_nN, kResult},
          {"share_within", "of the n, whose standard error is the target or less", &Row::share_within, kResult},
          {"smallest_seen_nN", "three standard errors", &Row::smallest_seen_nN, kResult},
          {"least_distance_um",
           "of two adhesions of the force asked for, from centre to centre, that are told apart without a network; "
           "empty: of another quantity, or not at 30 um",
           &Row::least_distance_um, kResult},
          {"largest_displacement_um", "of all beads", &Row::largest_displacement_um, kResult},
          {"beyond_linear", "share of the displacement that linear elasticity leaves out", &Row::left_out, kResult}}};
}

Table<Needed> needed_table() {
  using Row = Needed;
  return {.file = "plan/plan_needed.csv",
          .row = "each gel and noise",
          .columns = {{"youngs_modulus_kPa", "of the gel", &Row::youngs_modulus_kPa, kResult},
                      {"noise_um", "standard deviation of a displacement component", &Row::noise_um, kResult},
                      {"beads_per_um2",
                       "at which half of the fibres are within the target, and no less than the least asked for; "
                       "empty: none is enough",
                       &Row::beads_per_um2, kResult},
                      {"beads_per_um2_for_nine_in_ten", "the same for nine fibres in ten",
                       [](const Row& row) -> std::optional<double> {
                         return std::isfinite(row.of_most) ? std::optional(row.of_most) : std::nullopt;
                       },
                       kResult}}};
}

Table<DrawnTension> drawn_table() {
  using Row = DrawnTension;
  return {.file = "plan/plan_drawn.csv",
          .row = "each fibre in each drawn experiment",
          .columns = {{"experiment", "counts from 1", &Row::experiment},
                      {"fibre_id", "label of the fibre", &Row::fibre_id},
                      {"true_nN", "its tension", &Row::true_nN, kResult},
                      {"found_nN", "as fitted", &Row::found_nN, kResult},
                      {"predicted_error_nN", "standard error by the plan", &Row::predicted_error_nN, kResult},
                      {"stated_error_nN", "standard error by the fit itself", &Row::stated_error_nN, kResult}}};
}

Table<CellNumbers> cell_table() {
  using Row = CellNumbers;
  files::Columns<Row> powers;
  for (std::size_t k = 0; k < std::size(kCells); ++k)
    powers.push_back({"power_of_" + std::to_string(kCells[k]) + "_cells",
                      "chance to see the difference with so many cells of each condition",
                      [k](const Row& row) { return row.power.at(k); }, kResult});
  return {
      .file = "plan/plan_cells.csv",
      .row = "each type, difference and number of fibres",
      .columns = {{"type", "of the fibres", member(&Row::scatter, &Scatter::type)},
                  {"mean_nN", "tension", member(&Row::scatter, &Scatter::mean_nN), kResult},
                  {"between_cells_nN", "standard deviation of a cell's own mean",
                   member(&Row::scatter, &Scatter::between_cells_nN), kResult},
                  {"within_nN", "standard deviation of a cell's fibres about it",
                   member(&Row::scatter, &Scatter::within_nN), kResult},
                  {"error_nN", "standard error of a fibre's tension, root mean square",
                   member(&Row::scatter, &Scatter::error_nN), kResult},
                  {"source", "of the scatter", member(&Row::scatter, &Scatter::source)},
                  {"difference", "between two conditions, over the mean", &Row::difference, kResult},
                  {"fibres_per_cell", "of this type", &Row::fibres_per_cell, kResult},
                  {"cells", "of each condition that see it with the chance asked for; empty: more than ten thousand",
                   &Row::cells},
                  powers}};
}

std::string pages_of_tables() {
  return page_of(expected_table()) + page_of(needed_table()) + page_of(drawn_table()) + page_of(cell_table()) +
         page_of(space_expected_table()) + page_of(space_needed_table()) + page_of(space_drawn_table());
}

}  // namespace mbtfm::plan
