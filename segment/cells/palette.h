/// The colours of a segmented cell's parts, in pictures and in ImageJ.
#pragma once

#include <cstdint>

#include "pipeline/contract/cell.h"

namespace mbtfm::cells {

struct Colour {
  std::uint8_t red, green, blue;
};

// Those of the report's plots (Okabe & Ito's palette, which colour-blind people can tell apart), lighter for the dark
// ground.
inline constexpr Colour kVentralColour{0, 214, 143}, kDorsalColour{86, 180, 255}, kArcColour{255, 183, 40},
    kEdgeColour{255, 122, 82}, kAdhesionColour{255, 170, 235}, kOutlineColour{225, 225, 225},
    kUnexplainedColour{90, 60, 255};

constexpr Colour colour_of(FibreType type) {
  return type == FibreType::ventral  ? kVentralColour
         : type == FibreType::dorsal ? kDorsalColour
         : type == FibreType::edge   ? kEdgeColour
                                     : kArcColour;
}

}  // namespace mbtfm::cells
