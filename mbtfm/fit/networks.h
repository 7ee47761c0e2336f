/// The ensemble of networks over a cell, and where the fit starts on them.
#pragma once

#include <optional>
#include <vector>

#include "mbtfm/fit/parameters.h"
#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/results.h"

namespace mbtfm::fit {

/// `first`, then further ones over the same cell from other seeds.
std::vector<cables::CableNetwork> span_ensemble(const Network& first, const Cell& cell, const Parameters& parameters,
                                                int threads);
/// The same without a first one that is given.
std::vector<cables::CableNetwork> span_ensemble(const Cell& cell, const Parameters& parameters, int threads);
/// The same networks of other cables.
std::vector<cables::CableNetwork> of_cables(const std::vector<cables::CableNetwork>& networks,
                                            const cables::CableParameters& cables);

/// Where the fit starts on a network: from the tensions of the frame before, fibres that are new since then at the
/// others' mean; else from tensions that are all equal.
tensions::Trial start_on(const cables::CableNetwork& network, const tensions::LinearData& data,
                         const std::vector<int>& adhesion_ids, const std::optional<std::vector<Tension>>& before);

/// Networks of the cables that the scene calls for.
struct StartedNetworks {
  std::vector<cables::CableNetwork> networks;
  tensions::Trial start;  ///< on the first of them
  Effect elasticity;
};
/// @param networks  of elastic cables
StartedNetworks with_cables_called_for(std::vector<cables::CableNetwork> networks, const tensions::LinearData& data,
                                       const std::vector<int>& adhesion_ids,
                                       const std::optional<std::vector<Tension>>& before, const Parameters& parameters);

/// The tensions found may stretch cables that those of the start did not. @return elasticity switched on, if so
std::optional<Effect> elasticity_after_all(const Effect& elasticity, const cables::CableNetwork& network,
                                           const tensions::Trial& answer, const Parameters& parameters);

}  // namespace mbtfm::fit
