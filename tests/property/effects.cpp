/// Which effects a scene calls for, each with a scene that does and one that does not; and what is said of those left
/// out, against a fit that has them.
#include "mbtfm/tensions/effects.h"

#include "network/cables/effects.h"
#include "pipeline/contract/errors.h"
#include "substrate/effects.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

Cell cell_of_three_fibres() {
  Cell cell = test::round_cell(14, 12, {{1, 6}, {3, 9}, {4, 11}});
  return cell;
}

TensionScene scene(double noise, unsigned seed = 1) {
  return test::scene_of(cell_of_three_fibres(), Eigen::Vector4d(0.06, 3, 5, 2), 1500, noise, seed);
}

std::vector<cables::CableNetwork> networks(int n, cables::CableParameters cables = {}) {
  std::vector<cables::CableNetwork> result;
  for (int m = 0; m < n; ++m) {
    mesh::NetworkParameters parameters;
    parameters.seed = 10 + static_cast<std::uint64_t>(m);
    result.emplace_back(mesh::generate_network(cell_of_three_fibres(), parameters).network, cables);
  }
  return result;
}

EnsembleFit fitted(const std::vector<cables::CableNetwork>& on, LinearData data, const TensionScene& s,
                   std::optional<Loss> loss = Loss::squares) {
  FitParameters parameters;
  parameters.n_meshes = static_cast<int>(on.size());
  parameters.loss = loss;
  return fit_ensemble(on, data, s.adhesion_ids, parameters, 2);
}

TEST(EffectsOfTheFit, stress_fibres_where_the_cell_has_any) {
  Cell with = cell_of_three_fibres(), without = test::round_cell(14, 12), left_out = with;
  EXPECT_TRUE(cables::take_fibres(with, Switch::automatic).is_on);
  EXPECT_EQ(with.fibres.size(), 3u);
  EXPECT_FALSE(cables::take_fibres(without, Switch::automatic).is_on);
  EXPECT_FALSE(cables::take_fibres(left_out, Switch::off).is_on);
  EXPECT_TRUE(left_out.fibres.empty());
  EXPECT_THROW(cables::take_fibres(without, Switch::on), InvalidData);
}

/// A triangular lattice whose border is held all round: pulling alike, its cables stay as they are.
Network held_lattice(int side) {
  Network network;
  const auto index = [&](int i, int j) { return j * side + i; };
  int adhesion_id = 0;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      network.vertices_um.push_back({1.5 * (i + 0.5 * j), 1.5 * std::sqrt(0.75) * j});
      const bool is_border = i == 0 || j == 0 || i == side - 1 || j == side - 1;
      network.adhesion_id.push_back(is_border ? ++adhesion_id : 0);
      for (const auto& [di, dj] : {std::pair{-1, 0}, std::pair{0, -1}, std::pair{1, -1}}) {
        if (i + di < 0 || i + di >= side || j + dj < 0) continue;
        network.links.push_back({.vertex_a = index(i + di, j + dj), .vertex_b = index(i, j), .rest_length_um = 1.5});
      }
    }
  return network;
}

TEST(EffectsOfTheFit, elasticity_where_cables_would_be_longer_than_at_rest) {
  EXPECT_FALSE(cables::decide_elasticity(cables::CableNetwork(held_lattice(7)), {0.06}, {}).is_on);
  const auto cell = networks(1);
  EXPECT_TRUE(cables::decide_elasticity(cell.front(), {0.06, 0.06, 0.06, 0.06}, {}).is_on);
}

TEST(EffectsOfTheFit, elasticity_that_is_off_is_that_of_very_soft_cables) {
  const auto off = networks(1, {.axial_stiffness_nN = 0}), soft = networks(1, {.axial_stiffness_nN = 1e-7});
  const std::vector<double> tensions = {0.06, 3, 5, 2};
  const auto a = off[0].equilibrium(tensions), b = soft[0].equilibrium(tensions);
  ASSERT_TRUE(a.report.converged) << a.report.reason;
  const Eigen::VectorXd fa = off[0].adhesion_forces_nN(tensions, a), fb = soft[0].adhesion_forces_nN(tensions, b);
  EXPECT_LE((fa - fb).norm(), 1e-5 * fb.norm());  // EA is 2e-6 of the network's tension, over strains of up to some
  const Eigen::MatrixXd da = off[0].adhesion_force_derivatives(tensions, a);
  EXPECT_TRUE(da.allFinite());
  // without elasticity forces are linear in the tensions (Euler: R = dR/dt t)
  EXPECT_LE((da * Eigen::Vector4d(0.06, 3, 5, 2) - fa).norm(), 1e-5 * fa.norm());
}

TEST(EffectsOfTheFit, a_robust_loss_where_beads_stray) {
  TensionScene s = scene(0.05);
  const auto on = networks(1);
  EXPECT_FALSE(robust_loss_effect(Switch::automatic,
                                  fitted(on, s.data, s, loss_of_switch(Switch::automatic, Loss::huber)).misfit.loss)
                   .is_on);
  for (std::size_t i = 0; i < s.beads.size(); i += 33) s.beads[i].displacement_um += Vec2{8 * s.beads[i].sigma_um, 0};
  s.data = reduce(s.beads, s.compliance_um_per_nN);
  EXPECT_TRUE(robust_loss_effect(Switch::automatic,
                                 fitted(on, s.data, s, loss_of_switch(Switch::automatic, Loss::huber)).misfit.loss)
                  .is_on);
  EXPECT_FALSE(
      robust_loss_effect(Switch::off, fitted(on, s.data, s, loss_of_switch(Switch::off, Loss::huber)).misfit.loss)
          .is_on);
  EXPECT_EQ(loss_of_switch(Switch::on, Loss::tukey), Loss::tukey);
}

TEST(EffectsOfTheFit, time_coupling_where_there_is_a_frame_before) {
  EXPECT_TRUE(decide_time_coupling(true, Switch::automatic).is_on);
  EXPECT_FALSE(decide_time_coupling(true, Switch::off).is_on);
  EXPECT_FALSE(decide_time_coupling(false, Switch::automatic).is_on);
  EXPECT_FALSE(decide_time_coupling(false, Switch::on).is_on) << "a series has a first frame";
}

}  // namespace
}  // namespace mbtfm::tensions
