/// The cell on its beads, as the effects that the scene calls for want it: ready to be fitted.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "mbtfm/fit/inputs.h"
#include "mbtfm/fit/parameters.h"
#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/placement.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/results.h"
#include "pipeline/contract/work.h"
#include "substrate/compliance.h"

namespace mbtfm::fit {

/// Of a time series, in the cell's frame.
struct SeriesOnGel {
  std::vector<tensions::SeriesFrame> frames;
  substrate::SharedResponse response = {};  ///< of all beads; none where there is no series
};

/// What was decided on the way.
struct Decisions {
  Effect fibres, under_load, placement, elasticity, time_coupling;
  Effect strain = {};  ///< by the forces found
};

struct ReadyCell {
  std::unique_ptr<substrate::Substrate> gel;
  tensions::CellOnBeads scene;  ///< the cell with the fibres that its networks have, the beads in state and frame
  std::optional<tensions::ForcesBeyond> beyond;  ///< the cut; none: not allowed for
  tensions::Placement placement;                 ///< of the cell on the beads
  std::vector<cables::CableNetwork> networks;
  tensions::Trial start;  ///< on the first of them
  SeriesOnGel series;
  Decisions decisions;
};

/// With the data of the beads, which are large where the cell is: the fit takes them over.
struct ReadyFit {
  ReadyCell cell;
  tensions::LinearData data;
};
/// @param parameters  as_switched()
/// @throws InputError where the network is not that of the cell; UsageError where a switch asks for what the scene has
/// not
ReadyFit make_ready(const Inputs& inputs, const Parameters& parameters, const Work& work);
/// The same on networks of other cables.
ReadyCell with_cables(ReadyCell cell, const tensions::LinearData& data, const cables::CableParameters& cables,
                      const Inputs& inputs);

// From beads to data: how the gel under a cell carries its forces to them, and what they may do besides.

struct GelUnderCell {
  const substrate::Substrate& gel;
  const Cell& cell;
  const Parameters& parameters;
  int threads = 1;
};

substrate::SharedResponse response_of(const GelUnderCell& on, const DisplacementField& beads);

/// Those that the fit uses: all, or those within fit.region_um of the cell.
std::vector<bool> beads_in_region(const DisplacementField& beads, const Cell& cell,
                                  const tensions::FitParameters& parameters);

struct DataOfBeads {
  tensions::LinearData data;
  std::optional<tensions::ForcesBeyond> beyond = {};  ///< the cut; none: not allowed for
};
/// @param response  of these beads
/// @throws UsageError where forces beyond the cut are switched on and there is no cut
DataOfBeads data_of(const GelUnderCell& on, const DisplacementField& beads, substrate::SharedResponse response);
tensions::LinearData data_of(const GelUnderCell& on, const DisplacementField& beads);

/// The beads in the state that explains them better. Those of a series stay at rest: all frames share their places.
/// @param data  of the beads at rest
/// @throws UsageError where a series is to be taken under load
tensions::BeadsOfState in_their_state(const GelUnderCell& on, const DisplacementField& at_rest,
                                      tensions::LinearData data, bool is_series);

// The ensemble of networks over a cell, and where the fit starts on them.

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
