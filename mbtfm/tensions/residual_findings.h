/// What the residuals of the beads say against a fit.
#pragma once

#include <optional>

#include "mbtfm/tensions/findings.h"

namespace mbtfm::tensions {

/// All squares together, and those of the worst region. A note where missing-fibre or missing-adhesion names the places
/// that have them.
std::optional<Finding> unexplained(const FitOutcome& outcome);
std::optional<Finding> beads_disagree(const FitOutcome& outcome);
/// Of the beads on which the tensions rest.
std::optional<Finding> telling_beads_scatter(const FitOutcome& outcome);
/// Far from the cell.
std::optional<Finding> noise_disagrees(const FitOutcome& outcome);

}  // namespace mbtfm::tensions
