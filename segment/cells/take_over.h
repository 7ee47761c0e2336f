/// Lines that another one has taken over. Internal to segment/ (OpenCV types).
#pragma once

#include <vector>

#include "segment/cells/trace.h"

namespace mbtfm::cells {

/// Where lines cross at a small angle one may be led on over the other's course, and the other ends there. A line that
/// ends on another one gets back the part of it that lies on its own course: if both together lie on a slightly bent
/// parabola, and the other one's two parts do not. What is left of the other one ends there.
std::vector<Trace> with_own_courses(std::vector<Trace> lines, const Ridges& ridges, const TraceRule& rule);

}  // namespace mbtfm::cells
