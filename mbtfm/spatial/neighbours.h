/// Which beads in space are astray, by the beads around them.
#pragma once

#include <vector>

#include "mbtfm/spatial/parameters.h"

namespace mbtfm::spatial {

struct Observed;

/// u − u_n by bead. u_n is the displacement at the bead's place of the linear field that the 16 nearest beads follow
/// (biweight, Maronna, Martin & Yohai, Robust Statistics, 2006, 5.4; as the normalised median test of Westerweel &
/// Scarano, Exp. Fluids 39 (2005) 1096). Beads that are far off are no neighbours in a second and a third round. No
/// traction is assumed: what a reconstruction smooths away does not look astray here.
struct AmongNeighbours {
  std::vector<double> distance;  ///< over the errors of both
  /// Of both, over the beads' sigma: what the neighbours scatter about the field, at least one (where no sigma is
  /// stated: at least what the beads at half of all places scatter).
  std::vector<double> error;
};
/// Empty where there are 16 beads or fewer.
AmongNeighbours among_neighbours(const Observed& observed);

/// By bead, the probability that it is good, 0 if that is below one half: good beads follow their neighbours with
/// errors of Student's distribution with one, two or four degrees of freedom, whichever is likeliest, as fields are not
/// linear; others lie anywhere in the box of all displacements. Their share is the likeliest (expectation–maximisation;
/// Dempster, Laird & Rubin, J. R. Stat. Soc. B 39 (1977) 1).
/// @return empty where there are 16 beads or fewer, and for losses other than mixture
std::vector<double> probabilities_of_good(BeadLoss loss, const Observed& observed);

}  // namespace mbtfm::spatial
