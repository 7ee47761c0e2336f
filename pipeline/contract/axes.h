/// Where the axes of a user's data point.
#pragma once

#include "pipeline/contract/words.h"

namespace mbtfm {

/// The z of a file, or its slices from the first to the last. No program can distinguish a gel from its mirror image.
enum class ZPoints { into_gel, out_of_gel };
constexpr auto words(ZPoints) { return std::array{"into-gel", "out-of-gel"}; }

}  // namespace mbtfm
