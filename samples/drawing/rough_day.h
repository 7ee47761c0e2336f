/// Acquisitions as laboratories make them.
#pragma once

#include "samples/drawing/scenario.h"

namespace mbtfm::drawing {

/// The scenario with what went wrong on the day of this number: the stage moved, a second cell pulls, debris, focus,
/// light, camera, pictures that were processed. Each fault happens or not, with a random size: what it was is in
/// truth/scenario.toml, as all of a scenario. Gel, density and noise of the beads vary, too.
ScenarioParameters rough_day(ScenarioParameters scenario, std::uint64_t number);

}  // namespace mbtfm::drawing
