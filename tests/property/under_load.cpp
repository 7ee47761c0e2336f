
#include "mbtfm/tensions/placement.h"
#include "pipeline/stage/effects.h"
#include "tests/support/layer_data.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

constexpr double kSize_um = 1;    // of the adhesions
constexpr double kNoise = 0.002;  // of the largest displacement, which a lone bead on an adhesion has

/// Adhesions are seen under load, and the beads are put back by what they move. The scene's beads are those under load.
struct PullingCell {
  Cell cell;
  TensionScene scene;
  DisplacementField at_rest;

  LinearData data_of(const DisplacementField& beads) const { return test::data_on_layer(beads, cell, test::kGel); }
  BeadsOfState state(const DisplacementField& beads, Switch setting = Switch::automatic) const {
    return take_state(
        beads, data_of(beads), [&](const DisplacementField& there) { return data_of(there); }, kSize_um, 0.01, setting,
        carried());
  }
  Carried carried() const {
    return [this](const LinearData& data) {
      return carried_um(test::kGel, substrate::ellipses_of(cell.adhesions), free_forces_nN(data.reduced),
                        data.position_um, data.displacement_um, 1);
    };
  }
  /// Fitted on the network that made the forces.
  EnsembleFit fit(const LinearData& data) const { return test::fit_to(data, scene); }
};

/// @param share  of tensions that move the gel by more than an adhesion's radius
PullingCell pulling_cell(double share, double noise, unsigned seed) {
  Cell cell = test::round_cell(12, 9, {{1, 5}, {2, 7}});
  PullingCell result{.cell = cell,
                     .scene = test::scene_of(cell, share * Eigen::Vector3d(0.2, 16, 8), 900, noise, seed)};
  result.at_rest = result.scene.beads;
  for (std::size_t i = 0; i < result.at_rest.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const Eigen::VectorXd& u = result.scene.displacement_um;
    result.at_rest[i].position_um += Vec2{-u[row], -u[row + 1]};
  }
  return result;
}

double error_of(const PullingCell& cell, const EnsembleFit& fit) {
  return (values_of(fit) - cell.scene.tensions_nN).norm() / std::sqrt(fit.tensions.covariance_nN2.trace());
}

TEST(UnderLoad, beads_go_to_where_the_cell_pulls_them) {
  const DisplacementField beads = {{.position_um = {3, 4}, .displacement_um = {0.1, -0.2}}};
  EXPECT_EQ(under_load(beads)[0].position_um.x, 3 + 0.1);
  EXPECT_EQ(under_load(beads)[0].position_um.y, 4 - 0.2);
  EXPECT_EQ(under_load(beads)[0].displacement_um.y, -0.2);
}

TEST(UnderLoad, tensions_of_a_cell_seen_under_load_are_right_by_the_beads_there) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const PullingCell cell = pulling_cell(1, kNoise, seed);
    ASSERT_GT(cell.scene.largest_um, 0.4) << "an adhesion's radius";
    const BeadsOfState state = cell.state(cell.at_rest);
    EXPECT_TRUE(state.effect.is_on) << stage::line_of(state.effect);
    // three tensions: chance exceeds three standard errors of their sum of squares once in hundreds
    EXPECT_LT(error_of(cell, cell.fit(state.data)), 3);
    EXPECT_GT(error_of(cell, cell.fit(cell.data_of(cell.at_rest))), 3);
    EXPECT_FALSE(cell.state(cell.at_rest, Switch::off).effect.is_on);
  }
}

TEST(UnderLoad, beads_that_are_given_under_load_stay_there) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const PullingCell cell = pulling_cell(1, kNoise, seed);
    const BeadsOfState state = cell.state(cell.scene.beads);
    EXPECT_FALSE(state.effect.is_on) << stage::line_of(state.effect);
    EXPECT_EQ(state.beads[7].position_um.x, cell.scene.beads[7].position_um.x);
    // so clearly that the data under load are not asked for; by them it is the same
    const auto fail = [](const DisplacementField&) -> LinearData { throw std::logic_error("asked"); };
    const LinearData data = cell.data_of(cell.scene.beads);
    EXPECT_FALSE(
        take_state(cell.scene.beads, data, fail, kSize_um, 0.01, Switch::automatic, cell.carried()).effect.is_on);
    const auto data_of = [&](const DisplacementField& there) { return cell.data_of(there); };
    EXPECT_FALSE(take_state(cell.scene.beads, data, data_of, kSize_um, 0.01, Switch::automatic).effect.is_on);
  }
}

TEST(UnderLoad, beads_that_hardly_move_are_not_asked) {
  const PullingCell cell = pulling_cell(0.001, 0.02, 1);
  ASSERT_LT(cell.scene.largest_um, 0.01 * kSize_um);
  const auto fail = [](const DisplacementField&) -> LinearData { throw std::logic_error("asked"); };
  const LinearData data = cell.data_of(cell.at_rest);
  EXPECT_FALSE(take_state(cell.at_rest, data, fail, kSize_um, 0.01, Switch::automatic).effect.is_on);
  EXPECT_FALSE(take_state(cell.at_rest, data, fail, kSize_um, 0.01, Switch::off).effect.is_on);
  EXPECT_TRUE(cell.state(cell.at_rest, Switch::on).effect.is_on);
}

}  // namespace
}  // namespace mbtfm::tensions
