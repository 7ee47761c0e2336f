#include "samples/plan/tables.h"

namespace mbtfm::plan {

using files::kResult;
using files::member;
using files::Table;

namespace {

constexpr const char* kNoiseInSpace = "standard deviation of a displacement component along x or y";

template <class Row>
files::Columns<Row> point_columns(const char* density, const char* density_is, const char* noise_is) {
  return {{"youngs_modulus_kPa", "of the gel", member(&Row::point, &Point::youngs_modulus_kPa), kResult},
          {density, density_is, member(&Row::point, &Point::density), kResult},
          {"noise_um", noise_is, member(&Row::point, &Point::noise_um), kResult}};
}

template <class Row>
files::Columns<Row> target_columns() {
  return {{"target_nN", "standard error that is asked for", &Row::target_nN, kResult},
          {"share_within", "of the n, whose standard error is the target or less", &Row::share_within, kResult},
          {"smallest_seen_nN", "three standard errors", &Row::smallest_seen_nN, kResult}};
}

template <class Row>
files::Columns<Row> strain_columns() {
  return {{"largest_displacement_um", "of all beads", &Row::largest_displacement_um, kResult},
          {"beyond_linear", "share of the displacement that linear elasticity leaves out", &Row::left_out, kResult}};
}

constexpr const char* kHowMany = "how many of them the cell has; of several, the numbers are medians";

/// @param density  "beads_per_um2"
Table<Needed> needed_table(const char* file, const char* noise_is, const std::string& density, const char* density_is,
                           const char* most_is) {
  using Row = Needed;
  return {.file = file,
          .row = "each gel and noise",
          .columns = {{"youngs_modulus_kPa", "of the gel", &Row::youngs_modulus_kPa, kResult},
                      {"noise_um", noise_is, &Row::noise_um, kResult},
                      {density, density_is, &Row::density, kResult},
                      {density + "_for_nine_in_ten", most_is, &Row::of_most, kResult}}};
}

}  // namespace

Table<Expected> expected_table(Quantity) {
  using Row = Expected;
  return {
      .file = "plan/plan.csv",
      .row = "each gel, density, noise and quantity",
      .columns = {
          point_columns<Row>("beads_per_um2", "beads by area", "standard deviation of a displacement component"),
          {"quantity", "what is estimated; `adhesion force alone`: by the method adhesion-forces, without a network",
           &Row::quantity},
          {"n", kHowMany, &Row::n},
          {"standard_error_nN", "expected, by beads and model together", &Row::standard_error_nN, kResult},
          {"from_beads_nN", "by the noise of the beads: the Cramér–Rao bound", &Row::from_beads_nN, kResult},
          {"from_mesh_nN", "by the mesh of the network", &Row::from_mesh_nN, kResult},
          {"from_segmentation_nN", "by the segmentation", &Row::from_segmentation_nN, kResult},
          {"from_other_nN", "by the rest of the model's misfit", &Row::from_other_nN, kResult},
          target_columns<Row>(),
          {"least_distance_um",
           "of two adhesions of the force asked for, from centre to centre, that are told apart without a network; "
           "empty: of another quantity, or not at 30 um",
           &Row::least_distance_um, kResult},
          strain_columns<Row>()}};
}

Table<SpaceExpected> expected_table(SpaceQuantity) {
  using Row = SpaceExpected;
  return {
      .file = "plan/plan.csv of a cell in space",
      .row = "each gel, density, noise and quantity",
      .columns = {
          point_columns<Row>("beads_per_um3", "beads by volume", kNoiseInSpace),
          {"quantity", "what is estimated; total force: the sum of the magnitudes of the patches' forces",
           &Row::quantity},
          {"n", kHowMany, &Row::n},
          {"standard_error_nN", "as the reconstruction states it", &Row::standard_error_nN, kResult},
          {"from_beads_nN", "by the noise of the beads", &Row::from_beads_nN, kResult},
          {"from_background_nN", "by tractions beside the patches that the beads do not tell from them",
           &Row::from_background_nN, kResult},
          target_columns<Row>(),
          {"resolution_um",
           "in the map, at the middle patch: forces closer together than this look like one; from about twice that on "
           "they are mostly seen as two",
           &Row::resolution_um, kResult},
          {"least_distance_um",
           "of two patches of the force asked for, from centre to centre, whose forces are told apart where the image "
           "shows them and nothing else pulls; empty: of another quantity, or at no distance",
           &Row::least_distance_um, kResult},
          {"numbers_told", "how many numbers of the tractions the beads tell", &Row::degrees, kResult},
          strain_columns<Row>()}};
}

Table<Needed> needed_table(Quantity) {
  return needed_table("plan/plan_needed.csv", "standard deviation of a displacement component", "beads_per_um2",
                      "at which half of the fibres are within the target, and no less than the least asked for; empty: "
                      "none is enough",
                      "the same for nine fibres in ten");
}

Table<Needed> needed_table(SpaceQuantity) {
  return needed_table(
      "plan/plan_needed.csv of a cell in space", kNoiseInSpace, "beads_per_um3",
      "at which half of the patches are within the target, and no less than the least asked for; empty: "
      "more than four times the densest asked for",
      "the same for nine patches in ten");
}

Table<DrawnNumber> drawn_table(Quantity) {
  using Row = DrawnNumber;
  return {.file = "plan/plan_drawn.csv",
          .row = "each fibre in each drawn experiment",
          .columns = {{"experiment", "counts from 1", &Row::experiment},
                      {"fibre_id", "label of the fibre", &Row::id},
                      {"true_nN", "its tension", &Row::true_nN, kResult},
                      {"found_nN", "as fitted", &Row::found_nN, kResult},
                      {"predicted_error_nN", "standard error by the plan", &Row::predicted_error_nN, kResult},
                      {"stated_error_nN", "standard error by the fit itself", &Row::stated_error_nN, kResult}}};
}

Table<DrawnNumber> drawn_table(SpaceQuantity) {
  using Row = DrawnNumber;
  return {.file = "plan/plan_drawn.csv of a cell in space",
          .row = "each component of each patch's force in each drawn experiment",
          .columns = {
              {"experiment", "counts from 1", &Row::experiment},
              {"adhesion_id", "label of the patch", &Row::id},
              {"component",
               "`along the surface`: as the true force goes there; `normal`: out of the gel; `across`: square to both",
               &Row::component},
              {"true_nN", "its true value", &Row::true_nN, kResult},
              {"found_nN", "as reconstructed", &Row::found_nN, kResult},
              {"predicted_error_nN", "standard error by the plan", &Row::predicted_error_nN, kResult}}};
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
  return page_of(expected_table(Quantity{})) + page_of(needed_table(Quantity{})) + page_of(drawn_table(Quantity{})) +
         page_of(cell_table()) + page_of(expected_table(SpaceQuantity{})) + page_of(needed_table(SpaceQuantity{})) +
         page_of(drawn_table(SpaceQuantity{}));
}

}  // namespace mbtfm::plan
