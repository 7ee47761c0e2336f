/// The fit of a cell, from what was read to all that is reported of it.
#pragma once

#include <optional>
#include <vector>

#include "mbtfm/fit/checks.h"
#include "mbtfm/fit/readings.h"
#include "mbtfm/tensions/effects.h"
#include "pipeline/contract/fit_summary.h"

namespace mbtfm::fit {

/// What is found.
struct Found {
  std::vector<Tension> tensions;
  std::vector<AdhesionForce> forces;
  FitSummary summary;
  double budget_s = 0;  ///< that its errors took
};

/// Displacements that the model has at the beads, in their own frame.
struct ModelFields {
  DisplacementField fitted, without_fibres;
};

struct FittedCell {
  Cell seen;              ///< with its fibres, whether the networks have them or not
  Parameters parameters;  ///< as_switched()
  ReadyCell ready;
  tensions::EnsembleFit fit;
  Found found;
  FoundMotions motions;
  ModelChecks checks;
  ModelFields fields;
  std::optional<Reading> reading = {}, smoothing = {};  ///< that explain the beads best; none: not looked for
  std::vector<tensions::FrameFit> frames = {};          ///< of a time series
  std::vector<Effect> effects = {};                     ///< of table_of_effects()
  std::vector<tensions::Change> changes = {};           ///< by effects that are off, where that was asked
};

/// @throws InputError, InvalidData, UsageError, NotSolved
FittedCell fit_cell(const Inputs& inputs, const Parameters& parameters, const Work& work);

}  // namespace mbtfm::fit
