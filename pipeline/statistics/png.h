/// Pictures in pixels from drawings in lines.
#pragma once

#include <string>

#include "pipeline/files/csv_files.h"

namespace mbtfm::statistics {

/// Draws a stand-alone SVG into a PNG file. @param scale  pixels by unit of the drawing
/// @throws OutputError where it cannot be written; InternalError where it cannot be drawn
void write_png(const Path& file, const std::string& svg, double scale);

}  // namespace mbtfm::statistics
