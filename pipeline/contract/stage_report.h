/// What a stage says of its work.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/effects.h"
#include "pipeline/contract/figures.h"
#include "pipeline/contract/findings.h"

namespace mbtfm {

/// What a stage reports: into its record and the last line on the terminal.
struct StageReport {
  bool converged = true;
  std::string summary;  ///< what was found, and what was skipped, in one line
  Figures figures = {};
  std::vector<Effect> effects = {};
  std::vector<Finding> findings;
};

}  // namespace mbtfm
