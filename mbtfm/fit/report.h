/// What the fit tells of itself: into its record and the last line on the terminal.
#pragma once

#include "mbtfm/fit/fit_cell.h"
#include "pipeline/contract/stage_report.h"

namespace mbtfm::fit {

/// The gel's figures are those of its last call.
StageReport report_of(const FittedCell& cell);

}  // namespace mbtfm::fit
