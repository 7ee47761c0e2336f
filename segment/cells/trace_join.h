/// Pieces of one line put together. Internal to segment/ (OpenCV types).
#pragma once

#include <vector>

#include "segment/cells/trace.h"

namespace mbtfm::cells {

/// Pieces put together to lines, each end once and no line to a ring. Where a piece ends on another one, that is cut:
/// of the three ends that meet there the two that fit best are joined. Two ends fit where one parabola passes through
/// the last parts of both, with little bend, and the way between is brighter than what lies beside it; the best pair
/// first, then again with the longer pieces. The way between is filled with points along the parabola.
/// Candidates come from a grid of the ends: time grows with the number of pieces.
std::vector<Trace> joined(std::vector<Trace> traces, const Ridges& ridges, const TraceRule& rule);

}  // namespace mbtfm::cells
