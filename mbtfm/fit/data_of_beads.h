/// From beads to data: how the gel under a cell carries its forces to them, and what they may do besides.
#pragma once

#include <optional>
#include <vector>

#include "mbtfm/fit/parameters.h"
#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/placement.h"
#include "substrate/compliance.h"

namespace mbtfm::fit {

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

}  // namespace mbtfm::fit
