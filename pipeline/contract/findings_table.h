/// A part of the table of findings.
#pragma once

#include "pipeline/contract/findings.h"

namespace mbtfm {

/// About models and results, those of the fit first.
std::vector<KindOfFinding> kinds_of_results();

}  // namespace mbtfm
