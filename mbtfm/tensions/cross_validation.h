/// Do the fibres' types matter? Tensions drawn from what the types usually have, and the same with dorsal and ventral
/// exchanged: where the second explain the beads worse, the types carry information (thesis fig. 3.15).
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_problem.h"
#include "pipeline/contract/cell.h"

namespace mbtfm::tensions {

/// Tensions that fibres of a type were found to have; draws take one of them.
using TypeTensions = std::map<FibreType, std::vector<double>>;

struct CrossValidation {
  std::vector<double> own, exchanged;  ///< relative L2 of each draw
};

/// Every draw is an equilibrium of its own, started from that of the given trial: tensions drawn at random are too far
/// from it for derivatives.
/// @param types  of the network's groups from 1 on; the network keeps the trial's tension
CrossValidation cross_validate(const TensionProblem& problem, const LinearData& data, const Trial& around,
                               const std::vector<FibreType>& types, const TypeTensions& tensions, int n_draws,
                               std::uint64_t seed, int threads);

}  // namespace mbtfm::tensions
