/// A picture of a sheet: its mean tension, the traction under it, and its contraction if that varies.
#pragma once

#include <string>

namespace mbtfm::sheet {

struct Solution;

/// An SVG file: two or three maps, x to the right and y down. @param caption  a line of text below
std::string picture_of(const Solution& solution, const std::string& caption);

}  // namespace mbtfm::sheet
