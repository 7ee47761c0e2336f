/// A first look at a pair of bead images.
#pragma once

#include <string>

#include "pipeline/contract/geometry.h"
#include "segment/images/image.h"

namespace mbtfm::beads {

struct PairLook {
  Vec2 shift_px;            ///< of the stressed image as a whole
  std::string orientation;  ///< "turned by 90 degrees", "mirrored"; empty: the same way up, or nothing fits
};

/// Phase correlation of both images at about 500 px a side, as they are and in the seven other orientations of a
/// square. Another orientation counts if its peak is three times as high: that of beads which do not belong together is
/// chance in all eight.
PairLook look_at_pair(const images::Image& relaxed, const images::Image& stressed);

}  // namespace mbtfm::beads
