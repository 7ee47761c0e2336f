/// Forces that the adhesions exert beside what the network gives them: the network is a model, and where it is wrong
/// the beads show it (Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001) 425). With e of model_error.h found and not only
/// allowed for,
///
///   y = C (R(t) + e) + n,   Var e_a = g_a L_a,   1 / g_a ~ Gamma(ν/2, ν τ²/2),   Σ e_a = 0,  Σ x_a × e_a = 0:
///
/// Student's t with ν = 4 degrees of freedom by adhesion (so heavy are the tails of networks of other formulations, and
/// a fibre that was not segmented deviates at its two ends alone). g and τ² are of greatest restricted likelihood, the
/// tensions being free to follow (Dempster, Laird & Rubin, J. R. Stat. Soc. B 39 (1977) 1). Where the network is right
/// τ² goes to 0 and its own forces come back.
#pragma once

#include <Eigen/Core>

#include "mbtfm/tensions/model_error.h"

namespace mbtfm::tensions {

struct Discrepancy {
  VectorXd share_nN;    ///< g_a, by adhesion
  double scale_nN = 0;  ///< τ²
  OwnForces forces;     ///< R + e given the data: no error of a tension that the data free reaches it
};

/// @param mean  of the meshes, at tensions common to all
/// @param tensions_nN  those above zero may follow, the others are held there
/// @param centres_um  of the adhesions; empty: their forces need not balance
Discrepancy discrepancy_of(const ReducedData& data, const MeshForces& mean, const VectorXd& tensions_nN,
                           const ModelError& error, const std::vector<Vec2>& centres_um, int threads);

/// With the variances of single adhesions that the beads show.
ModelError with_discrepancy(ModelError error, const Discrepancy& found);

}  // namespace mbtfm::tensions
