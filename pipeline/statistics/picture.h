/// A drawing as a picture or a page.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/path.h"

namespace mbtfm::statistics {

/// As PNG that says how many dots an inch it has, by librsvg, on the drawing's own ground. The same bytes for the same
/// drawing.
/// @param svg  a well-formed drawing with a width and a height in px
/// @param width_mm  in print
/// @throws InternalError where it cannot be drawn, OutputError where it cannot be written
void write_png(const Path& file, const std::string& svg, double width_mm, double dots_per_inch);
/// Drawings of one size in turn, for ever: an animated PNG, which browsers and image viewers know. After the first each
/// holds only the pixels that change.
/// @param drawings  one at least
void write_animation(const Path& file, const std::vector<std::string>& drawings);
/// As PDF of this width.
void write_pdf(const Path& file, const std::string& svg, double width_mm);

}  // namespace mbtfm::statistics
