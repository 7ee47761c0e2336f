#include "mbtfm/tensions/edge_forces.h"

#include "mbtfm/tensions/common_motion.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

/// A round cell with adhesions at its edge and two fibres. Its dim adhesions, half-way between the others, are no part
/// of the network, and pull inwards.
struct DimlyHeld {
  static constexpr int kAdhesions = 12;
  Cell cell = test::round_cell(12, kAdhesions);
  TensionScene scene = scene_of(cell);

  static TensionScene scene_of(Cell& cell) {
    test::add_ventral(cell, 1, 5);
    test::add_ventral(cell, 2, 7);
    return test::scene_of(cell, Eigen::Vector3d(0.1, 6, 3), 3000, 0.05, 5);
  }
  void pull_inwards(double sum_nN) {
    const Vec2 middle = centre_of(cell.outline_um);
    std::vector<substrate::Ellipse> discs;
    Eigen::VectorXd forces(2 * kAdhesions);
    for (int a = 0; a < kAdhesions; ++a) {
      const Vec2 place = 0.5 * (cell.adhesions[a].position_um + cell.adhesions[(a + 1) % kAdhesions].position_um),
                 inward = 1 / norm(middle - place) * (middle - place);
      discs.push_back({.centre_um = place, .semi_major_um = 0.5, .semi_minor_um = 0.5, .angle_rad = 0});
      forces.segment<2>(2 * Eigen::Index{a}) << inward.x, inward.y;
    }
    scene.displacement_um += sum_nN / kAdhesions *
                             (greens::make_greens(test::kGel, {.model = substrate::ModelKind::layer}, 1)
                                  ->compliance_um_per_nN(scene.points_um, discs) *
                              forces);
  }
  EnsembleFit fitted(unsigned seed) {
    test::measure(scene, 0.02, seed);
    return test::fit_to(test::with_motions(scene, scene.beads), scene);
  }
};

TEST(EdgeForces, are_found_where_dim_adhesions_pull_inwards) {
  constexpr double kSum_nN = 6;
  DimlyHeld cell;
  cell.pull_inwards(kSum_nN);
  const EnsembleFit fit = cell.fitted(1);
  const EdgeForces found = edge_forces(fit, cell.cell, test::kGel);
  EXPECT_TRUE(found.are_there()) << found.probability;
  const EnsembleFit with = with_edge_forces(fit, found, cell.cell, test::kGel, 0);
  const double true_nN = kSum_nN + total_nN(cell.scene.forces_nN);
  EXPECT_LE(std::abs(with.total_force_nN.value - true_nN), 2 * with.total_force_nN.standard_error);
  EXPECT_LT(std::abs(with.total_force_nN.value - true_nN), std::abs(fit.total_force_nN.value - true_nN));
  EXPECT_GT(std::abs(fit.total_force_nN.value - true_nN), 2 * fit.total_force_nN.standard_error)
      << "or nothing would be asked for";
}

/// By chance three standard errors, which the odds ask for, come once in 700 cells; and errors grow by little then.
TEST(EdgeForces, noise_calls_for_none) {
  DimlyHeld sound;
  int n_found = 0;
  double widest = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const EnsembleFit fit = sound.fitted(seed);
    const EdgeForces found = edge_forces(fit, sound.cell, test::kGel);
    n_found += found.are_there();
    const EnsembleFit with = with_edge_forces(fit, found, sound.cell, test::kGel, 0);
    if (found.probability < 0.02)
      widest = std::max(widest, with.total_force_nN.standard_error / fit.total_force_nN.standard_error);
  }
  EXPECT_LE(n_found, 2) << "at a chance of 1 in 700, more than 2 of 100 once in 2 000";
  EXPECT_LE(widest, 1.25);
}

TEST(EdgeForces, a_cell_without_room_has_none) {
  DimlyHeld cell;
  cell.cell.outline_um = {{0, 0}, {0.1, 0}, {0.1, 0.1}};
  EXPECT_EQ(edge_forces(cell.fitted(1), cell.cell, test::kGel).probability, 0);
}

}  // namespace
}  // namespace mbtfm::tensions
