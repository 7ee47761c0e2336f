/// What a run makes of a stage, as run.json states it.
#pragma once

#include "pipeline/contract/words.h"

namespace mbtfm {

enum class StageState {
  up_to_date,  ///< this version made the outputs from these inputs and settings
  given,       ///< the user put the outputs there
  replaced,    ///< the user changed outputs of ours: they are kept
  not_asked,   ///< left out by --only
  must_run
};
constexpr auto words(StageState) { return std::array{"up to date", "given", "replaced", "not asked for", "run"}; }

}  // namespace mbtfm
