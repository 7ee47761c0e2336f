/// mbtfm-fit: tensions, adhesion forces and their error bars from bead displacements.
#include <algorithm>

#include "mbtfm/fit/files.h"
#include "mbtfm/fit/fit_cell.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::fit {
namespace {

/// @throws InputError where no cell pulls like that
void expect_plausible(stage::StageContext& context, const Found& found, const std::vector<Adhesion>& adhesions) {
  const double total_nN = std::max(0.0, found.summary.total_force_nN);  // of noise alone: either side of 0
  context.expect_plausible("total_force_nN", total_nN);
  context.expect_plausible("fibre_tension_nN", stage::surest_fibre_tension_nN(found.tensions));
  context.expect_plausible("traction_kPa", stage::traction_of_half_the_force_kPa(found.forces, adhesions));
}

StageReport run(const Parameters& parameters, stage::StageContext& context) {
  context.progress(0, "reading");
  const Inputs inputs = read_inputs(context, parameters);
  context.expect_plausible("beads_per_um2", beads_per_um2(inputs.beads));
  const FittedCell cell = fit_cell(inputs, parameters, {context.threads, context.progress});
  expect_plausible(context, cell.found, cell.ready.scene.cell.adhesions);
  write_results(context, cell, inputs.beads);
  context.progress(0.97, "tractions by the usual method");
  write_usual_method(context, inputs, parameters.gel);
  context.progress(1, "done");
  return report_of(cell);
}

}  // namespace
}  // namespace mbtfm::fit

int main(int argc, char** argv) {
  using mbtfm::fit::Parameters;
  using mbtfm::stage::FileArgument;
  return mbtfm::stage::run_stage<Parameters>({.name = "fit",
                                              .files = {{"cell", FileArgument::Kind::input},
                                                        {"network", FileArgument::Kind::input},
                                                        {"displacement", FileArgument::Kind::input},
                                                        {"start", FileArgument::Kind::optional_input},
                                                        {"frames", FileArgument::Kind::optional_input},
                                                        {"kept", FileArgument::Kind::optional_input},
                                                        {"out", FileArgument::Kind::output_folder}}},
                                             argc, argv, mbtfm::fit::run);
}
