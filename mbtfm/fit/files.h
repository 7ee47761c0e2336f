/// The files of mbtfm-fit: what it reads, and all that it writes.
#pragma once

#include "mbtfm/fit/inputs.h"
#include "mbtfm/fit/parameters.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/stage_report.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::fit {

struct FittedCell;

/// Registers each file that it reads.
Inputs read_inputs(stage::StageContext& context, const Parameters& parameters);

void write_results(stage::StageContext& context, const FittedCell& cell, const DisplacementField& tracked);

// What the usual method says of the same beads: tractions by FTTC, beside the fit and never in it.

/// fttc.csv and fttc.json: as mbtfm-traction writes them with its defaults, on and around the cell. If the beads do not
/// allow it, fttc.json has the reason as its `obstacle`, and there is no fttc.csv.
void write_usual_method(stage::StageContext& context, const Inputs& inputs, const Gel& gel);

// What the fit reports of itself: into its record and the last line on the terminal.

/// The gel's figures are those of its last call.
StageReport report_of(const FittedCell& cell);

}  // namespace mbtfm::fit
