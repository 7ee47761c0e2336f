/// What a stage found as JSON objects, one a line (docs/formats.md, "Events").
#pragma once

#include <string>

#include "pipeline/contract/stage_report.h"

namespace mbtfm::stage {

/// Of its findings, then of its effects.
std::string events_of(const std::string& stage, const StageReport& report);

}  // namespace mbtfm::stage
