/// A pair of bead images: a first look, and a picture of both for the eye.
#pragma once

#include <string>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/geometry.h"
#include "segment/beads/placement.h"
#include "segment/images/image.h"
#include "segment/images/png.h"

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

/// How a whole field, places and vectors, lies against the adhesions of its cell: of the eight readings the one in
/// which free forces at these places explain it best, without a network. Costs about a second.
/// @param middle_um  of the picture, about which a field is turned
/// @returns empty: as it is, or nothing is sure
std::string orientation_of_forces(const DisplacementField& field, const std::vector<Vec2>& adhesions_um,
                                  Vec2 middle_um);

/// Relaxed green, stressed purple, white where both are bright, in the frame of the cell's pictures; each stretched
/// from its median to the brightest beads, and reduced to 1000 pixels at most along its longer side. Black where one of
/// them shows nothing.
/// @param placement  of the relaxed picture in the stressed one
/// @throws InvalidData where the sizes differ
images::Picture picture_of_beads(const images::Image& relaxed, const images::Image& stressed,
                                 const Placement& placement, CellWith cell_with);

}  // namespace mbtfm::beads
