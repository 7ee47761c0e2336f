/// Colours that represent numbers: maps whose lightness rises all the way, so that colour-blind eyes and grey printers
/// distinguish them.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace mbtfm::charts {

using Colour = std::array<double, 3>;  ///< red, green, blue, 0 to 255

enum class ColourMap {
  plasma,  ///< without its lightest fifth, which is lost on white paper
  viridis
};
/// @param share  0 to 1; what lies beyond counts as the nearer end
/// Source: S. van der Walt & N. Smith, matplotlib.
Colour colour_at(ColourMap map, double share);
/// Shares between which its colours are mixed evenly.
std::vector<double> stops_of(ColourMap map);
/// "#rrggbb"
std::string hex(const Colour& colour);

}  // namespace mbtfm::charts
