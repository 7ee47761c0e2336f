/// A picture of a sheet: its mean tension, and the traction under it.
#pragma once

#include <string>

#include "continuum/sheet/forward.h"

namespace mbtfm::sheet {

/// An SVG file: two maps, x to the right and y down. @param caption  a line of text below
std::string picture_of(const Solution& solution, const std::string& caption);

}  // namespace mbtfm::sheet
