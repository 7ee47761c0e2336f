/// Inside of the bead tracker: beads that move otherwise than those around them, and whether these stretch towards
/// them.
#pragma once

#include "segment/beads/scene.h"

namespace mbtfm::beads {

/// Flag "neighbours disagree" what moves by itself: a gel cannot do that.
///
/// What pulls a bead pulls those around it, too. About a patch of force of radius a that moves its middle by U beside
/// what the surroundings do, they move as the surface of an incompressible half-space does (Cerruti),
///
///   u(d) = c + G d + (a/|d|) (U + (U·e) e),   U = u_bead − c,   e = d/|d|,
///
/// of which c, G and a are fitted to the good beads around, softened within two bead sigmas. A right bead at an
/// adhesion has an a of some pixels; a false partner has a = 0, or less if it stays behind where the others are pulled.
/// Asked are beads that contradict their neighbours as outliers do, and beads of groups that no way of small steps
/// connects with most of the picture: those agree with one another, and so only the beads beyond the group are
/// witnesses. A bead is flagged if a is below the radius of what a lens shows, a bead's own, by two standard errors.
/// @return how many
int flag_unpulled(const Scene& scene, double threshold, std::vector<Track>& tracks);

}  // namespace mbtfm::beads
