/// What the usual method says of the same beads: tractions by FTTC, beside the fit and never in it.
#pragma once

#include "mbtfm/fit/inputs.h"
#include "pipeline/contract/gel.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::fit {

/// fttc.csv and fttc.json: as mbtfm-traction writes them with its defaults, on and around the cell. If the beads do not
/// allow it, fttc.json has the reason as its `obstacle`, and there is no fttc.csv.
void write_usual_method(stage::StageContext& context, const Inputs& inputs, const Gel& gel);

}  // namespace mbtfm::fit
