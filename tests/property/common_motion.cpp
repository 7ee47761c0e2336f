#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "pipeline/contract/errors.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

constexpr AffineMotion kMotion{
    .shift = {0.4, -0.2}, .turn_rad = 0.005, .growth = -0.003, .stretch = 0.001, .skew = 0.002, .centre = {20, 30}};

void move(DisplacementField& beads, const AffineMotion& motion) {
  for (Bead& bead : beads) bead.displacement_um += motion.at(bead.position_um);
}

EnsembleFit fit_of(const TensionScene& scene, const LinearData& data, Loss loss = Loss::squares) {
  return test::fit_to(data, scene, {.loss = loss});
}

TEST(CommonMotion, whatever_it_is_the_tensions_and_their_errors_stay) {
  const TensionScene scene = test::tension_scene("case_21", 600, 0.05, 3);
  for (const Loss loss : {Loss::squares, Loss::huber}) {
    const LinearData still = test::with_motions(scene, scene.beads);
    DisplacementField moved_beads = scene.beads;
    move(moved_beads, kMotion);
    const LinearData moved = test::with_motions(scene, moved_beads);
    const EnsembleFit a = fit_of(scene, still, loss), b = fit_of(scene, moved, loss);
    const double scale = values_of(a).norm();
    EXPECT_LE((values_of(a) - values_of(b)).norm(), 1e-6 * scale) << name_of(loss);  // where iterations end
    EXPECT_LE((a.tensions.covariance_nN2 - b.tensions.covariance_nN2).norm(), 1e-5 * a.tensions.covariance_nN2.norm())
        << name_of(loss);
    EXPECT_NEAR(a.misfit.chi_squared_per_degree, b.misfit.chi_squared_per_degree, 1e-6) << name_of(loss);
    EXPECT_NEAR(relative_l2(a.data, a.forces.nN), relative_l2(b.data, b.forces.nN), 1e-6) << name_of(loss);
  }
}

TEST(CommonMotion, without_allowing_for_it_growth_is_taken_for_force) {
  TensionScene scene = test::tension_scene("case_21", 600, 0.05, 3);
  move(scene.beads, {.growth = 0.003});
  const LinearData blind = reduce(scene.beads, scene.compliance_um_per_nN),
                   seeing = test::with_motions(scene, scene.beads);
  const double truth = total_nN(scene.forces_nN);
  const EnsembleFit a = fit_of(scene, blind), b = fit_of(scene, seeing);
  EXPECT_GT(std::abs(a.total_force_nN.value - truth), 5 * a.total_force_nN.standard_error);
  EXPECT_LT(std::abs(b.total_force_nN.value - truth), 4 * b.total_force_nN.standard_error);
}

TEST(CommonMotion, what_was_planted_is_found_within_its_stated_error) {
  TensionScene scene = test::tension_scene("case_21", 400, 0.05, 1);
  constexpr int kDraws = 60;
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(6);
  for (unsigned draw = 1; draw <= kDraws; ++draw) {
    test::measure(scene, 0.05, draw);
    move(scene.beads, kMotion);
    const LinearData data = test::with_motions(scene, scene.beads);
    const EnsembleFit fit = fit_of(scene, data);
    const FoundMotion found = common_motion_among(motions_beside(data, fit), data);
    const AffineMotion& m = found.motion;
    const Vec2 shift = m.shift - kMotion.at(m.centre);
    Eigen::VectorXd error(6);
    error << shift.x, shift.y, m.turn_rad - kMotion.turn_rad, m.growth - kMotion.growth, m.stretch - kMotion.stretch,
        m.skew - kMotion.skew;
    squares += error.cwiseQuotient(found.sigma).cwiseAbs2() / kDraws;
  }
  // a mean of 60 squared normal numbers has a standard deviation of .18
  for (const double square : squares) EXPECT_NEAR(square, 1, 4 * 0.18);
}

TEST(CommonMotion, a_bent_one_is_found_and_noise_is_taken_for_none) {
  TensionScene scene = test::tension_scene("case_21", 400, 0.05, 1);
  constexpr int kDraws = 40;
  double mean = 0;
  for (unsigned draw = 1; draw <= kDraws; ++draw) {
    test::measure(scene, 0.05, draw);
    const LinearData data = test::with_motions(scene, scene.beads);
    mean += curved_motion_beside(fit_of(scene, data)).chi_squared / kDraws;
  }
  EXPECT_NEAR(mean, 14, 4 * std::sqrt(2 * 14.0 / kDraws)) << "chi squared of 14 degrees of freedom";
  const double sigma_um = scene.beads.front().sigma_um;
  Vec2 centre;
  for (const Bead& bead : scene.beads) centre += 1.0 / 400 * bead.position_um;
  double squares = 0;
  // as a lens distorts, by twice the noise 40 um out: 800 components then add more than 100 to chi squared
  for (Bead& bead : scene.beads) {
    const Vec2 d = 1.0 / 40 * (bead.position_um - centre);
    const Vec2 bent = 2 * sigma_um * dot(d, d) * d;
    squares += dot(bent, bent) / 400;
    bead.displacement_um += bent;
  }
  const LinearData data = test::with_motions(scene, scene.beads);
  const CurvedMotion found = curved_motion_beside(fit_of(scene, data));
  EXPECT_GT(found.chi_squared, 36.1);
  EXPECT_GT(found.rms_um, 0.2 * std::sqrt(squares)) << "most of it is even growth, which is taken off";
  EXPECT_LT(found.rms_um, 2 * std::sqrt(squares));
}

TEST(CommonMotion, beads_that_a_contracting_cell_cannot_move_so_are_refused) {
  TensionScene scene = test::tension_scene("case_21", 400, 0.05, 1);
  const auto start = [&](const DisplacementField& beads) {
    const LinearData data = test::with_motions(scene, beads);
    return uniform_start({scene.cables, data.reduced, scene.adhesion_ids});
  };
  EXPECT_NO_THROW(start(scene.beads));
  DisplacementField reversed = scene.beads, still = scene.beads;
  for (Bead& bead : reversed) bead.displacement_um = -1 * bead.displacement_um;
  EXPECT_THROW(start(reversed), InvalidData);
  test::Normal normal(3);
  for (Bead& bead : still) bead.displacement_um = {bead.sigma_um * normal(), bead.sigma_um * normal()};
  EXPECT_NO_THROW(start(still)) << "a cell that pulls at nothing is a cell";
}

TEST(CommonMotion, reduced_data_are_those_of_the_projected_displacements) {
  const TensionScene scene = test::tension_scene("case_21", 50, 0.05, 7);
  const LinearData data = reweighted(test::with_motions(scene, scene.beads), Eigen::VectorXd::LinSpaced(50, 0.1, 1));
  const Eigen::VectorXd weight = squared_weights(data);
  const Eigen::MatrixXd& M = data.motions.shapes;
  const Eigen::MatrixXd P =
      Eigen::MatrixXd::Identity(100, 100) -
      M * (M.transpose() * weight.asDiagonal() * M).inverse() * M.transpose() * weight.asDiagonal();
  for (const double size : {0.0, 1.0}) {
    const Eigen::VectorXd forces = size * scene.forces_nN;
    const Eigen::VectorXd left = P * (data.displacement_um - scene.compliance_um_per_nN * forces);
    const double wanted = left.cwiseAbs2().dot(weight);
    const double reduced =
        (displace(data.reduced, forces) - data.reduced.target).squaredNorm() + data.reduced.floor_squared;
    EXPECT_NEAR(reduced, wanted, 1e-9 * wanted);
  }
}

TEST(CommonMotion, of_beads_in_one_place_or_none_is_no_obstacle) {
  const TensionScene scene = test::tension_scene("case_21", 50, 0.05, 7);
  DisplacementField beads(scene.beads.begin(), scene.beads.end());
  for (Bead& bead : beads) bead.position_um = {3, 4};
  const LinearData data = test::with_motions(scene, beads);
  EXPECT_TRUE(data.reduced.target.allFinite());
  EXPECT_EQ(affine_motions(DisplacementField{}).rows(), 0);
}

TEST(CommonMotion, its_largest_displacement_is_reached_and_never_passed) {
  constexpr AffineMotion kStill{
      .turn_rad = 0.005, .growth = -0.003, .stretch = 0.001, .skew = 0.002, .centre = {20, 30}};
  double largest = 0;
  for (int i = 0; i < 3600; ++i) {
    const double angle = i * 1.7453292519943296e-3;
    largest = std::max(largest, norm(kStill.at(kStill.centre + 7 * Vec2{std::cos(angle), std::sin(angle)})));
  }
  EXPECT_NEAR(largest, kStill.largest_within(7), 1e-5 * largest);
}

}  // namespace
}  // namespace mbtfm::tensions
