/// Pieces of one line put together. Internal to segment/ (OpenCV types).
#pragma once

#include <vector>

#include "segment/cells/trace.h"

namespace mbtfm::cells {

/// Pieces put together to lines, each end once and no line to a ring. How well ends fit is told by their turn, their
/// offset, the gap between them, their heights, and by whether something bright lies in the gap; the best pair first.
/// Candidates come from a grid of the ends: time grows with the number of pieces.
std::vector<Trace> joined(std::vector<Trace> traces, const Ridges& ridges, const TraceRule& rule);

struct BridgedLine {
  Trace trace;
  std::vector<std::size_t> pieces;  ///< by place among the fibres, in the order of the line
};

/// Fibres put together across gaps that are longer than a hidden line's: over the rim of the nucleus, or where a
/// neighbour in the same carpet outshines them. Both must be long and lie on one slightly bent parabola, and the way
/// between must be brighter than texture. The best pair first.
/// @param ridges  of the image without these fibres: what is bright in a gap is no neighbour
std::vector<BridgedLine> bridged(const std::vector<Trace>& fibres, const Ridges& ridges, const TraceRule& rule);

}  // namespace mbtfm::cells
