/// Pieces of one line put together. Internal to segment/ (OpenCV types).
#pragma once

#include <vector>

#include "segment/cells/trace.h"

namespace mbtfm::cells {

/// Pieces put together to lines, each end once and no line to a ring. How well ends fit is told by their turn, their
/// offset, the gap between them, their heights, and by whether something bright lies in the gap; the best pair first.
/// Candidates come from a grid of the ends: time grows with the number of pieces.
std::vector<Trace> joined(std::vector<Trace> traces, const Ridges& ridges, const TraceRule& rule);

}  // namespace mbtfm::cells
