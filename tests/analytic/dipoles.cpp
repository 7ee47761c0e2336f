/// Maps of discs that pull at each other, on scattered beads.
#include <Eigen/Core>

#include "tests/support/dipole_scene.h"

namespace mbtfm::tractions {
namespace {

TractionParameters half_space(TractionMethod method) {
  TractionParameters parameters;
  parameters.method = method;
  parameters.gel_model = GelModel::half_space;
  return parameters;
}

/// Footprints below and above what the beads resolve. A bound of 1.2 is asked of the mean, in which noise has two standard
/// deviations of 0.1 in each scene's highest node; sums lose no more than the moments' noise, some per cent.
TEST(Sparse, has_neither_peaks_nor_moments_of_its_own_on_scattered_beads) {
  double peak = 0;
  for (const double radius_um : {0.27, 1.0, 2.0, 5.0}) {
    const test::DipoleScene scene = test::dipole_scene({.radius_um = radius_um}, 1);
    TractionInputs inputs = scene.inputs;
    inputs.adhesions.clear();
    const Reconstruction r = reconstruct(inputs, half_space(TractionMethod::sparse), 2);
    const double highest = test::sabass_score(scene, r.patches).peak;
    peak += highest / 4;
    EXPECT_LE(highest, 1.4) << radius_um;
    EXPECT_NEAR(sums_of(r, inputs, 0).contractile_moment_nN_um() / scene.moment_nN_um, 1, 0.05) << radius_um;
  }
  EXPECT_LE(peak, 1.2);
}

}  // namespace
}  // namespace mbtfm::tractions
