/// mbtfm-traction where the displacements are in space, and its files.
#pragma once

#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/stage_report.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::spatial {

struct StageParameters {
  Gel gel;
  tractions::TractionParameters traction;
  SpatialParameters spatial;
  substrate::SubstrateParameters substrate;
};

void declare(stage::ParameterList& list, StageParameters& parameters);

StageReport run_in_space(const StageParameters& parameters, stage::StageContext& context);

/// A table with a row for each vertex, and the surface with the same.
void write_tractions(const Path& csv, const Path& vtp, const Problem& problem,
                     const SpatialReconstruction& reconstruction);

/// The criterion that chose lambda, or "given".
const char* how_lambda(const SpatialReconstruction& reconstruction);
Figures summary_of(const Problem& problem, const SpatialReconstruction& reconstruction, const Balance& balance);

}  // namespace mbtfm::spatial
