#include "mbtfm/fit/usual_method.h"

#include <algorithm>
#include <string>
#include <vector>

#include "mbtfm/tractions/neighbour_noise.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/files/fit_summary.h"

namespace mbtfm::fit {

namespace {

/// Those in the outline's box and a little around it: a field far larger than the cell would fill the disk.
std::vector<GroundPatch> near(const Polygon& outline_um, std::vector<GroundPatch> patches) {
  constexpr double kMargin_um = 5;  // as around the report's maps
  const Extent box = extent_of(outline_um);
  std::erase_if(patches, [&](const GroundPatch& patch) {
    const Vec2 p = patch.position_um;
    return p.x < box.low_um.x - kMargin_um || p.x > box.high_um.x + kMargin_um || p.y < box.low_um.y - kMargin_um ||
           p.y > box.high_um.y + kMargin_um;
  });
  return patches;
}

}  // namespace

void write_usual_method(stage::StageContext& context, const Inputs& inputs, const Gel& gel) {
  // no adhesions: the errors of their forces would take longer than all else
  tractions::TractionInputs given{
      .beads = inputs.beads, .gel = gel, .adhesions = {}, .outline_um = inputs.cell.outline_um};
  tractions::assume_noise_um(given.beads);
  const tractions::TractionParameters parameters;
  Figures figures;
  try {
    const tractions::Reconstruction r = tractions::reconstruct(given, parameters, context.threads);
    tractions::write_tractions(context.output("out", "fttc.csv"), near(given.outline_um, r.patches));
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
