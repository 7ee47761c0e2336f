/// A time series, picture by picture.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/path.h"

namespace mbtfm::report {

/// For each frame that was fitted a drawing (SVG), all of one size: the cell's images with the fibres in the colours of
/// their tensions and the displacement of the beads, beside the total force over time. Empty for a cell of one frame.
/// @throws InputError where a file that the stages write lacks or is malformed
std::vector<std::string> drawings_of_series(const Path& cell);

}  // namespace mbtfm::report
