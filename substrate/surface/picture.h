/// A picture of a gel's surface: a map of its heights, and two sections.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/contract/surface.h"

namespace mbtfm::surface {

/// Colours of the heights, three bytes a vertex, from the lowest z (dark) to the highest (bright): viridis.
std::vector<std::uint8_t> colours_of(const HeightMap& map);

/// An SVG file: the map with lines of equal height, and sections through its middle with the standard error.
/// @param image_address  of a picture of colours_of(map), "data:image/png;base64,…"
/// @param from           a sentence on the source
/// @param off_um         beads or points that lie off the surface: crosses
std::string picture_of(const HeightMap& map, const std::string& image_address, const std::vector<Vec2>& off_um,
                       const std::string& from);

}  // namespace mbtfm::surface
