#include "mbtfm/fit/usual_method.h"

#include <string>

#include "mbtfm/tractions/neighbour_noise.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/fit_summary.h"

namespace mbtfm::fit {

void write_usual_method(stage::StageContext& context, const Inputs& inputs, const Gel& gel) {
  // no adhesions: the errors of their forces would take longer than all else
  tractions::TractionInputs given{
      .beads = inputs.beads, .gel = gel, .adhesions = {}, .outline_um = inputs.cell.outline_um};
  tractions::assume_noise_um(given.beads);
  const tractions::TractionParameters parameters;
  Figures figures;
  try {
    const tractions::Reconstruction r = tractions::reconstruct(given, parameters, context.threads);
    tractions::write_tractions(context.output("out", "fttc.csv"), r.patches);
    figures = tractions::summary_of(r, tractions::sums_of(r, given, parameters.grow_um));
    figures.emplace_back("lambda_by", std::string(name_of(parameters.lambda_by)));
  } catch (const InvalidData& e) {
    figures = {{"obstacle", std::string(e.what())}};
  } catch (const NotSolved& e) {
    figures = {{"obstacle", std::string(e.what())}};
  }
  files::write_figures(context.output("out", "fttc.json"), figures);
}

}  // namespace mbtfm::fit
