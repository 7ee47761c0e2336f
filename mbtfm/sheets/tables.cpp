#include "mbtfm/sheets/tables.h"

#include "pipeline/files/columns.h"

namespace mbtfm::sheets {
namespace {

using files::kForPeople;

files::Column<SheetEstimate> part(const char* name, const char* meaning, std::optional<double> SheetErrorParts::*of) {
  return {name, meaning, [of](const SheetEstimate& row) { return row.parts.*of; }, {.digits = kForPeople}};
}

const files::Table<SheetEstimate>& estimate_table() {
  using Row = SheetEstimate;
  static const files::Table<Row> table{
      .file = "sheet_fit.csv",
      .row = "each number of a sheet that the beads were asked for (`mbtfm-sheet --displacement`)",
      .columns = {
          {"quantity", "with its unit; stiffness is E h / (1 - nu²)", &Row::quantity},
          {"part",
           "of the sheet, where parts contract each by its own: inside, edge, or a cell of the label image; mean, "
           "of a contraction that varies; or the bundle; else empty",
           &Row::part},
          {"value", "where the misfit is least", &Row::value, {.digits = kForPeople}},
          {"sigma",
           "standard error; empty if the beads do not determine the quantity",
           &Row::sigma,
           {.digits = kForPeople}},
          {"low", "lower end of the 95 % interval; empty: none", &Row::low, {.digits = kForPeople}},
          {"high", "upper end of the 95 % interval; empty: none", &Row::high, {.digits = kForPeople}},
          {"identifiable", "the beads limit it to both sides", &Row::identifiable},
          part("by_beads",
               "part of sigma by noise of the beads' displacements; the squares of all parts add up to that "
               "of sigma",
               &SheetErrorParts::beads),
          part("by_motion", "part by the motion that all beads share; empty: none was allowed for",
               &SheetErrorParts::motion),
          part("by_model", "part by what the sheet leaves of the beads beyond their noise", &SheetErrorParts::model),
          part("by_mesh", "part by the sheet's triangles", &SheetErrorParts::mesh),
          part("by_outline", "part by the place of the outline (`outline_error_um`)", &SheetErrorParts::outline),
          part("by_gel",
               "part by the gel's modulus, thickness and Poisson's ratio; empty: no errors of these were given",
               &SheetErrorParts::gel),
          part("by_substrate", "part by what the model leaves out of the gel", &SheetErrorParts::substrate)}};
  return table;
}

const files::Table<SheetModel>& model_table() {
  using Row = SheetModel;
  static const files::Table<Row> table{
      .file = "sheet_models.csv",
      .row = "each model of what moves the beads under a sheet",
      .columns = {
          {"model", "nothing, the sheet, the sheet with more or in parts, or each adhesion for itself", &Row::name},
          {"n_parameters", "that were fitted", &Row::n_parameters},
          {"chi_squared", "of the misfit, in units of the noise", &Row::chi_squared, {.digits = kForPeople}},
          {"relative_l2", "of the misfit", &Row::relative_l2, {.digits = kForPeople}},
          {"aic", "Akaike's criterion", &Row::aic, {.digits = kForPeople}},
          {"bic", "the Bayesian criterion", &Row::bic, {.digits = kForPeople}}}};
  return table;
}

const files::Table<ContractionAt>& contraction_table() {
  using Row = ContractionAt;
  static const files::Table<Row> table{
      .file = "contraction.csv",
      .row = "each node of a sheet whose contraction varies (`mbtfm-sheet --displacement` with `fit_parts = field`)",
      .columns = {{"x_um", "place of the node", [](const Row& row) { return row.position_um.x; }},
                  {"y_um", "place of the node", [](const Row& row) { return row.position_um.y; }},
                  {"contraction_nN_per_um", "contraction there", &Row::nN_per_um, {.digits = kForPeople}},
                  {"sigma_nN_per_um", "its standard error", &Row::sigma_nN_per_um, {.digits = kForPeople}},
                  {"low_nN_per_um", "lower end of its 95 % interval", &Row::low_nN_per_um, {.digits = kForPeople}},
                  {"high_nN_per_um", "upper end of its 95 % interval", &Row::high_nN_per_um, {.digits = kForPeople}}}};
  return table;
}

}  // namespace

void write_contractions(const Path& file, const std::vector<ContractionAt>& rows) {
  files::write(file, contraction_table(), rows);
}
void write_estimates(const Path& file, const SheetFit& fit) { files::write(file, estimate_table(), fit.estimates); }
void write_models(const Path& file, const SheetFit& fit) { files::write(file, model_table(), fit.models); }
std::string pages_of_tables() {
  return page_of(estimate_table()) + page_of(contraction_table()) + page_of(model_table());
}

}  // namespace mbtfm::sheets
