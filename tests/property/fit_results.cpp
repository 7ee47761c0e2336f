/// What the fit tells its user of a cell as a whole.
#include "mbtfm/tensions/fit_results.h"

#include <gtest/gtest.h>

#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

TEST(FitSummary, expects_the_misfit_that_there_is_where_the_model_is_right) {
  Cell cell = test::round_cell(14, 16);
  for (const auto& [a, b] : {std::pair{1, 9}, {3, 12}, {5, 15}}) test::add_ventral(cell, a, b);
  test::TensionScene scene = test::scene_of(cell, Eigen::Vector4d(0.1, 3, 5, 2), 4000, 0.1, 7);
  const EnsembleFit fit = test::fit_own_network(scene);
  const FitSummary summary = summary_of(fit, {.cell = cell, .beads = scene.beads}, 0.5, {});
  EXPECT_NEAR(summary.noise_um, scene.beads.front().sigma_um, 0.1 * scene.beads.front().sigma_um);
  // of 8000 components; the noise level by the median of those far away is good to some per cent
  EXPECT_NEAR(summary.expected_relative_l2 / summary.relative_l2, 1, 0.1);
  EXPECT_NEAR(summary.fibre_force_nN + summary.network_force_nN, summary.total_force_nN, 1e-9 * summary.total_force_nN);
}

TEST(AdhesionForces, are_off_by_no_more_than_stated_where_the_cells_network_is_another) {
  Cell cell = test::round_cell(14, 24);
  for (const auto& [a, b] : {std::pair{1, 13}, {4, 18}, {7, 22}}) test::add_ventral(cell, a, b);
  double stated = 0, by_beads = 0;
  int n = 0;
  for (std::uint64_t seed = 5; seed < 8; ++seed) {
    test::TensionScene scene = test::scene_of(cell, Eigen::Vector4d(0.1, 3, 5, 2), 2000, 0.01, 7, {.seed = 100 + seed});
    std::vector<cables::CableNetwork> networks;
    for (int m = 0; m < 2; ++m) {
      networks.emplace_back(mesh::generate_network(cell, {.seed = 10 * seed + m}).network);
    }
    const EnsembleFit fit = fit_ensemble(networks, scene.data, scene.adhesion_ids, {.loss = Loss::squares}, 2);
    const std::vector<AdhesionForce> forces = forces_of(fit, cell);
    for (std::size_t a = 0; a < forces.size(); ++a, ++n) {
      const double truth = scene.forces_nN.segment<2>(2 * static_cast<Eigen::Index>(a)).norm();
      const double error = norm(forces[a].force_nN) - truth;
      stated += std::pow(error / *forces[a].sigma_nN, 2);
      by_beads += std::pow(error / fit.force_magnitudes_nN[a].noise, 2);
    }
  }
  EXPECT_LT(stated / n, 1 + 4 * std::sqrt(2.0 / n));  // as if each told of itself
  EXPECT_GT(by_beads / n, 2) << "the beads' noise alone must not explain it for this to tell anything";
}

/// A hexagon of so many edges a side on a regular triangulation, each edge a link of share 1.
Network regular_sheet(int side, double edge_um, Polygon& outline_um) {
  Network network;
  std::map<std::pair<int, int>, int> vertex_at;
  const auto place = [&](int i, int j) { return edge_um * Vec2{i + 0.5 * j, 0.5 * std::sqrt(3.0) * j}; };
  for (int j = -side; j <= side; ++j) {
    for (int i = std::max(-side, -side - j); i <= std::min(side, side - j); ++i) {
      vertex_at[{i, j}] = static_cast<int>(network.vertices_um.size());
      network.vertices_um.push_back(place(i, j));
      network.adhesion_id.push_back(0);
    }
  }
  for (const auto& [at, a] : vertex_at) {
    for (const auto& [di, dj] : {std::pair{1, 0}, {0, 1}, {-1, 1}}) {
      const auto b = vertex_at.find({at.first + di, at.second + dj});
      if (b == vertex_at.end()) continue;
      network.links.push_back({std::min(a, b->second), std::max(a, b->second), 0, edge_um, 1});
    }
  }
  network.adhesion_id[0] = 1;
  network.adhesion_id.back() = 2;
  for (const auto& [i, j] : {std::pair{side, 0}, {0, side}, {-side, side}, {-side, 0}, {0, -side}, {side, -side}}) {
    outline_um.push_back(place(i, j));
  }
  return network;
}

TEST(Cables, surface_tension_of_a_regular_network_is_root_three_times_tension_over_edge) {
  constexpr int kSide = 40;
  constexpr double kEdge_um = 0.7, kTension_nN = 0.06;
  Cell cell;
  const double found =
      cables::surface_tension_nN_per_um(regular_sheet(kSide, kEdge_um, cell.outline_um), cell.outline_um, kTension_nN);
  const double expected = std::sqrt(3.0) * kTension_nN / kEdge_um;
  // beside 9 side² links there are half as many more as the border has, 6 side, since these count whole
  EXPECT_NEAR(found, (1 + 3.0 / (9 * kSide)) * expected, 1e-9 * expected);
}

}  // namespace
}  // namespace mbtfm::tensions
