/// mbtfm-traction where the displacements are in space.
#pragma once

#include "mbtfm/spatial/parameters.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/stage_report.h"
#include "pipeline/stage/stage.h"
#include "substrate/compliance.h"

namespace mbtfm::spatial {

struct StageParameters {
  Gel gel;
  tractions::TractionParameters traction;
  SpatialParameters spatial;
  substrate::SubstrateParameters substrate;
};

void declare(stage::ParameterList& list, StageParameters& parameters);

StageReport run_in_space(const StageParameters& parameters, stage::StageContext& context);

}  // namespace mbtfm::spatial
