/// What the misfit of a bead costs: sum of rho(|r_b|) with r_b = S (u − G t), S = 1/sigma by direction, so that beads
/// that are wrong cannot pull the tractions away and no axis of the plane is special. Which beads in space are
/// outliers, by the beads around them. docs/theory/tractions-in-space.md (26).
#pragma once

#include <vector>

#include "mbtfm/spatial/parameters.h"

namespace mbtfm::spatial {

struct Observed;

/// Of l2 and of mixture, whose weights are given, all formulas for least squares hold as they are.
constexpr bool weighs_by_residual(BeadLoss loss) { return shape_of(loss) != inverse::Loss::squares; }

/// The loss as least squares about a residual.
struct Weighing {
  VectorXd by_row;   ///< weights of the squares of S (u − G t)
  double scale = 1;  ///< standard deviation of a component, in units of sigma, that most beads have
  /// So much one datum varies, and so many of them there are, as weighed: with these, formulas for least squares hold.
  double variance = 1, n_data = 0;
};

/// @param residual  S (u − G t)
/// @param degrees   of freedom that the tractions have taken: what is left of noise where they followed it
/// @param good     by bead, of a mixture: the probability that it is (probabilities_of_good()), which is its weight
Weighing weigh(BeadLoss loss, const Observed& observed, const VectorXd& residual, double degrees,
               const std::vector<double>& good = {});

/// u − u_n by bead. u_n is the displacement at the bead's place of the linear field that the 16 nearest beads follow
/// (biweight, Maronna, Martin & Yohai, Robust Statistics, 2006, 5.4; as the normalised median test of Westerweel &
/// Scarano, Exp. Fluids 39 (2005) 1096). Beads that are far off are no neighbours in a second and a third round. No
/// traction is assumed: what a reconstruction smooths away is no outlier here.
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
