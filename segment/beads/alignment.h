/// Inside of the bead tracker: one image turned against the other, as after a dish was put back on the stage.
#pragma once

#include <optional>

#include "segment/beads/placement.h"
#include "segment/beads/plane.h"

namespace mbtfm::beads {

/// The turn that carries the beads of `relaxed` to those of `stressed`, to half a degree and a few pixels: of turns by
/// up to 30 degrees, a half apart, the one whose pictures correlate best. Nothing where none stands out.
std::optional<Turn> turn_between(const Plane& relaxed, const Plane& stressed, double bead_sigma, int threads);

/// The image as it would be without that turn: result(x) = image(turn(x)).
images::Image turned_back(const images::Image& image, const Turn& turn, int threads);

}  // namespace mbtfm::beads
