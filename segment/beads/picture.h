/// The two bead images on each other, for the eye.
#pragma once

#include "pipeline/contract/beads.h"
#include "segment/beads/placement.h"
#include "segment/images/image.h"
#include "segment/images/png.h"

namespace mbtfm::beads {

/// Relaxed green, stressed purple, white where both are bright, in the frame of the cell's pictures; each stretched
/// from its median to the brightest beads, and reduced to 1000 pixels at most along its longer side. Black where one of
/// them shows nothing.
/// @param placement  of the relaxed picture in the stressed one
/// @throws InvalidData where the sizes differ
images::Picture picture_of_beads(const images::Image& relaxed, const images::Image& stressed,
                                 const Placement& placement, CellWith cell_with);

}  // namespace mbtfm::beads
