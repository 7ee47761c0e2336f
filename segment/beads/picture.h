/// The two bead images on each other, for the eye.
#pragma once

#include "pipeline/contract/geometry.h"
#include "segment/images/image.h"
#include "segment/images/png.h"

namespace mbtfm::beads {

/// Relaxed green, stressed purple, white where both are bright; each stretched from its median to the brightest beads,
/// and reduced to 1000 pixels at most along its longer side.
/// @param drift_px  of the stressed image, taken off to the next whole pixel
/// @throws InvalidData where the sizes differ
images::Picture picture_of_beads(const images::Image& relaxed, const images::Image& stressed, Vec2 drift_px);

}  // namespace mbtfm::beads
