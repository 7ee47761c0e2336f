// The independent reference: its own lengths are smoothed by 1e-5 um, its forces good to 1e-4 nN.

#include "tests/support/equilibrium.h"
#include "tests/support/reference_network.h"

namespace mbtfm {
namespace {

class CablesAgainstReference : public testing::TestWithParam<const char*> {
 protected:
  files::CsvTable table(const std::string& file) const {
    return files::CsvTable(test::source_folder() / "tests/data/reference/network" / GetParam() / file);
  }
  test::ReferenceNetwork reference = test::reference_network(GetParam());
  cables::CableNetwork cables{reference.network};
};

TEST_P(CablesAgainstReference, agrees_in_forces_derivatives_and_positions) {
  const auto& tensions = reference.tensions_nN;
  const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  const std::vector<Vec2> forces = cables.reactions_nN(tensions, equilibrium);
  const Eigen::MatrixXd derivatives = cables.adhesion_force_derivatives(tensions, equilibrium);

  const files::CsvTable rows = table("reactions.csv");
  Eigen::MatrixXd expected(derivatives.rows(), derivatives.cols());
  for (int i = 0; i < rows.n_rows(); ++i) {
    const int v = rows.integer(i, "vertex", 0);
    EXPECT_NEAR(forces[v].x, rows.number(i, "fx_nN"), 2e-4);
    EXPECT_NEAR(forces[v].y, rows.number(i, "fy_nN"), 2e-4);
    for (Eigen::Index g = 0; g < expected.cols(); ++g) {
      expected(2 * i, g) = rows.number(i, "dfx_dt" + std::to_string(g));
      expected(2 * i + 1, g) = rows.number(i, "dfy_dt" + std::to_string(g));
    }
  }
  EXPECT_LE((derivatives - expected).norm(), 1e-3 * expected.norm());

  // All tensions are positive, so the positions are unique; a collapsed cable's smoothing moves its ends by some eps.
  const files::CsvTable positions = table("equilibrium.csv");
  for (int v = 0; v < positions.n_rows(); ++v)
    EXPECT_LE(norm(equilibrium.positions_um[v] - Vec2{positions.number(v, "x_um"), positions.number(v, "y_um")}), 1e-4);
}

// Rounding the kinks off over eps displaces the ends of collapsed cables by some eps, and a force of stiffness EA / l0
// = 25 nN/um by the same part: 25 nN/um · 2 um · eps, of which a collapsed cable passes on a few per cent.
TEST_P(CablesAgainstReference, forces_do_not_depend_on_the_smoothing) {
  const auto forces = [&](double smoothing) {
    const cables::CableNetwork smoothed(reference.network, {.smoothing = smoothing});
    return smoothed.adhesion_forces_nN(reference.tensions_nN, smoothed.equilibrium(reference.tensions_nN)).eval();
  };
  const Eigen::VectorXd sharpest = forces(1e-7);
  for (const double smoothing : {1e-4, 1e-5, 1e-6})
    EXPECT_LE((forces(smoothing) - sharpest).lpNorm<Eigen::Infinity>(), 50 * smoothing) << smoothing;
}

INSTANTIATE_TEST_SUITE_P(, CablesAgainstReference, testing::Values("case_21", "case_22"));

}  // namespace
}  // namespace mbtfm
