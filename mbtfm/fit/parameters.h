/// All parameters of the fit of a cell.
#pragma once

#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/tension_fit.h"
#include "network/cables/cables.h"
#include "network/mesh/mesh.h"
#include "pipeline/contract/gel.h"
#include "pipeline/stage/effects.h"
#include "substrate/compliance.h"

namespace mbtfm::fit {

struct Parameters {
  Gel gel;
  mesh::NetworkParameters network;
  cables::CableParameters cables;
  substrate::SubstrateParameters substrate;
  tensions::FitParameters fit;
  tensions::SegmentationErrors segmentation;
  stage::EffectSwitches effects;
  Switch compare_sheet = Switch::automatic;  ///< as long as the fit itself for a cell of 10 000 beads
  bool explain = false;  ///< a fit for each effect that is off; what is off is off because it does not matter
};
void declare(stage::ParameterList& list, Parameters& parameters);

/// The same with what the switches say of the gel and of the loss.
Parameters as_switched(Parameters parameters);

}  // namespace mbtfm::fit
