/// The files of mbtfm-fit: what it reads, and all that it writes.
#pragma once

#include "mbtfm/fit/fit_cell.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::fit {

/// Registers each file that it reads.
Inputs read_inputs(stage::StageContext& context, const Parameters& parameters);

void write_results(stage::StageContext& context, const FittedCell& cell, const DisplacementField& tracked);

}  // namespace mbtfm::fit
