/// Pieces of one line put together. Internal to segment/ (OpenCV types).
#pragma once

#include <vector>

#include "segment/trace.h"

namespace mbtfm::segment {

/// Join ends that point at each other from at most `join_gap_px`, the best-fitting pair first, each end once and no
/// line to a ring. Candidates come from a grid of the ends: time grows with the number of pieces.
std::vector<Trace> joined(std::vector<Trace> traces, const TraceRule& rule);

}  // namespace mbtfm::segment
