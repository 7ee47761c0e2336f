/// The noise of a displacement field that states no errors, estimated from each bead's neighbours.
#pragma once

#include <optional>

#include "pipeline/contract/beads.h"

namespace mbtfm::tractions {

/// Standard deviation (um) of one component, taken to be the same for all beads. Each bead is compared with what a
/// quadratic polynomial through its 20 nearest neighbours predicts; the half of the beads whose neighbours show the
/// least strain represent all, as the field itself is smooth there. Errors that neighbours share, as those of
/// overlapping windows of image correlation do, are not seen.
/// @returns none for fewer than 40 beads, or where they lie so that no polynomial is determined
std::optional<double> noise_from_neighbours_um(const DisplacementField& beads);

/// If not all beads state their errors, all get the one that their neighbours show.
/// @returns it; none if they do, or if there are too few beads: the misfit then shows it
std::optional<double> assume_noise_um(DisplacementField& beads);

}  // namespace mbtfm::tractions
