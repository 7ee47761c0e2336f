/// What the fit tells of itself: into its record and the last line on the terminal.
#pragma once

#include "pipeline/contract/stage_report.h"

namespace mbtfm::fit {

struct FittedCell;

/// The gel's figures are those of its last call.
StageReport report_of(const FittedCell& cell);

}  // namespace mbtfm::fit
