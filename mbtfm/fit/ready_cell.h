/// The cell on its beads, as the effects that the scene calls for want it: ready to be fitted.
#pragma once

#include <memory>
#include <vector>

#include "mbtfm/fit/inputs.h"
#include "mbtfm/fit/parameters.h"
#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/placement.h"
#include "pipeline/contract/work.h"

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

}  // namespace mbtfm::fit
