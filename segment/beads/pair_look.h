/// A first look at a pair of bead images.
#pragma once

#include <string>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/geometry.h"
#include "segment/images/image.h"

namespace mbtfm::beads {

struct PairLook {
  Vec2 shift_px;            ///< of the stressed image as a whole
  std::string orientation;  ///< "turned by 90 degrees", "mirrored"; empty: the same way up, or nothing fits
};

/// How one picture may lie against another one, beside the same way up. The picture is mirrored first.
struct Orientation {
  const char* name;
  int quarter_turns;  ///< from x to y
  bool is_mirrored;
};
inline constexpr Orientation kOtherOrientations[] = {{"turned by 90 degrees", 1, false},
                                                     {"turned by 180 degrees", 2, false},
                                                     {"turned by -90 degrees", 3, false},
                                                     {"mirrored", 0, true},
                                                     {"mirrored and turned by 90 degrees", 1, true},
                                                     {"mirrored and turned by 180 degrees", 2, true},
                                                     {"mirrored and turned by -90 degrees", 3, true}};

/// Phase correlation of both images at about 500 px a side, as they are and in the seven other orientations of a
/// square. Another orientation counts if its peak is three times as high: that of beads which do not belong together is
/// chance in all eight.
PairLook look_at_pair(const images::Image& relaxed, const images::Image& stressed);

/// How the displacement of a table lies against a picture of its cell.
struct FieldLook {
  std::string places;   ///< in another orientation they are where the cell is bright; empty: as they are, or not known
  std::string vectors;  ///< in another orientation they point inward; empty likewise
};
/// The beads that move most lie beneath the cell, at its bright parts; all move towards its middle. Another orientation
/// counts if it shows that and the given one does not; a cell that is alike in both is no witness.
FieldLook look_at_field(const DisplacementField& field, const images::Image& cell, double pixel_um);

}  // namespace mbtfm::beads
