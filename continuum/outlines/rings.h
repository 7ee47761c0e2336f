/// Outlines as people have them: tables, masks, and selections drawn by hand.
#pragma once

#include <optional>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/path.h"

namespace mbtfm::outlines {

/// The outer ring of an outline and its holes, and where the image cuts the outer one.
struct Rings {
  std::vector<Polygon> points_um;
  Cuts cuts = {};
};

/// Of an outline.csv, of the largest part of a mask (PNG, TIFF), or of an ImageJ selection (.roi, .zip).
/// @param pixel_um  side of a pixel, in which masks and selections count
/// @throws UsageError where it lacks; InputError where a ring crosses itself or another, or has no area
Rings read_rings(const Path& file, const std::optional<double>& pixel_um);

/// Standard error of an outline's place (um), by who drew it: mbtfm-segment, another program or a hand.
/// @throws InputError if the record beside an outline.csv is malformed
double usual_error_um(const Path& file, const std::optional<double>& pixel_um);

}  // namespace mbtfm::outlines
