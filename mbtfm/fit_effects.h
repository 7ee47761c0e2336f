/// The effects of mbtfm-fit as a whole: the gel's, the network's and the fit's own.
#pragma once

#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/explain.h"
#include "mbtfm/tensions/fit_results.h"
#include "network/mesh/mesh.h"
#include "substrate/compliance.h"

namespace mbtfm::tensions {

struct FitStageParameters {
  Gel gel;
  mesh::NetworkParameters network;
  cables::CableParameters cables;
  substrate::SubstrateParameters substrate;
  FitParameters fit;
  SegmentationErrors segmentation;
  stage::EffectSwitches effects;
  bool explain = false;  ///< a fit for each effect that is off; what is off is off because it does not matter
};
void declare(stage::ParameterList& list, FitStageParameters& parameters);

/// A fit with all that went into it.
struct FittedCell {
  const FitStageParameters& parameters;
  const Cell& cell;  ///< with its fibres, whether in the network or not
  const FitInputs& inputs;
  const std::vector<cables::CableNetwork>& networks;
  const LinearData& data;
  const EnsembleFit& fit;
};

/// `first`, then further ones over the same cell from other seeds.
std::vector<cables::CableNetwork> span_ensemble(const Network& first, const Cell& cell, const FitStageParameters& p,
                                                int threads);
/// The same networks of other cables.
std::vector<cables::CableNetwork> of_cables(const std::vector<cables::CableNetwork>& networks,
                                            const cables::CableParameters& cables);

/// Say of each effect that is off what it would change, where anything tells: its `change` and `would_change`.
/// @return the changes by tension
std::vector<Change> explain(std::vector<Effect>& effects, const FittedCell& cell, int threads);

}  // namespace mbtfm::tensions
