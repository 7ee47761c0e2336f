#include "mbtfm/sheets/tables.h"

#include "mbtfm/sheets/field_fit.h"
#include "pipeline/files/sheet_files.h"

namespace mbtfm::sheets {
namespace {

using files::kResult;

files::Table<SheetModel> model_table() {
  using Row = SheetModel;
  return {.file = "sheet_models.csv",
          .row = "each model of what moves the beads under a sheet",
          .columns = {
              {"model", "nothing, the sheet, the sheet with more or in parts, or each adhesion for itself", &Row::name},
              {"n_parameters", "that were fitted", &Row::n_parameters},
              {"chi_squared", "of the misfit, in units of the noise", &Row::chi_squared, kResult},
              {"relative_l2", "of the misfit", &Row::relative_l2, kResult},
              {"aic", "Akaike's criterion", &Row::aic, kResult},
              {"bic", "the Bayesian criterion", &Row::bic, kResult}}};
}

files::Table<ContractionAt> contraction_table() {
  using Row = ContractionAt;
  return {
      .file = "contraction.csv",
      .row = "each node of a sheet whose contraction varies (`mbtfm-sheet --displacement` with `fit_parts = field`)",
      .columns = {{"x_um", "place of the node", files::x_of(&Row::position_um)},
                  {"y_um", "place of the node", files::y_of(&Row::position_um)},
                  {"contraction_nN_per_um", "contraction there", &Row::nN_per_um, kResult},
                  {"sigma_nN_per_um", "its standard error", &Row::sigma_nN_per_um, kResult},
                  {"low_nN_per_um", "lower end of its 95 % interval", &Row::low_nN_per_um, kResult},
                  {"high_nN_per_um", "upper end of its 95 % interval", &Row::high_nN_per_um, kResult}}};
}

}  // namespace

void write_contractions(const Path& file, const std::vector<ContractionAt>& rows) {
  files::write(file, contraction_table(), rows);
}
void write_estimates(const Path& file, const SheetFit& fit) {
  files::write(file, files::sheet_estimate_table(), {fit.estimates.begin(), fit.estimates.end()});
}
void write_models(const Path& file, const SheetFit& fit) { files::write(file, model_table(), fit.models); }
std::string pages_of_tables() {
  return page_of(files::sheet_estimate_table()) + page_of(contraction_table()) + page_of(model_table());
}

}  // namespace mbtfm::sheets
