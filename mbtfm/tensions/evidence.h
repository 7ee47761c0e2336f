/// What speaks for a model of the adhesions' forces that may itself be wrong:
///
///   u = G (R + δ) + n,   δ ~ N(0, τ²) by component,
///
/// with R the model's forces and τ² of greatest likelihood. Without δ all models are wrong in the same way where beads
/// are many: the one with the most parameters wins, whatever they mean. With R = 0 it is the model of forces that know
/// nothing of each other.
/// Source: Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001) 425; Schwarz, Ann. Stat. 6 (1978) 461.
#pragma once

#include <vector>

#include "mbtfm/tensions/linear_data.h"

namespace mbtfm::tensions {

/// Fills in `discrepancy_nN` and `bic_with_discrepancy` of each, from its `left_um`.
void weigh_with_discrepancy(std::vector<ModelScore>& models, const LinearData& data);

}  // namespace mbtfm::tensions
