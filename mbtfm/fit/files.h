/// The files of mbtfm-fit: what it reads, and all that it writes.
#pragma once

#include "mbtfm/fit/inputs.h"
#include "mbtfm/fit/parameters.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::fit {

struct FittedCell;

/// Registers each file that it reads.
Inputs read_inputs(stage::StageContext& context, const Parameters& parameters);

void write_results(stage::StageContext& context, const FittedCell& cell, const DisplacementField& tracked);

}  // namespace mbtfm::fit
