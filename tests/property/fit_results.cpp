/// What the fit tells its user of a cell as a whole.
#include <Eigen/Geometry>

#include "mbtfm/tensions/findings.h"
#include "mbtfm/tensions/fit_results.h"
#include "tests/support/substrate_scene.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

TEST(FitSummary, expects_the_misfit_that_there_is_where_the_model_is_right) {
  Cell cell = test::round_cell(14, 16, {{1, 9}, {3, 12}, {5, 15}});
  test::TensionScene scene = test::scene_of(cell, Eigen::Vector4d(0.1, 3, 5, 2), 4000, 0.1, 7);
  const EnsembleFit fit = test::fit_own_network(scene);
  const FitSummary summary = summary_of(fit, {.cell = cell, .beads = scene.beads}, 0.5, {});
  EXPECT_NEAR(summary.noise_um, scene.beads.front().sigma_um, 0.1 * scene.beads.front().sigma_um);
  // of 8000 components; the noise level by the median of those far away is good to some per cent
  EXPECT_NEAR(summary.expected_relative_l2 / summary.relative_l2, 1, 0.1);
  EXPECT_NEAR(summary.fibre_force_nN + summary.network_force_nN, summary.total_force_nN, 1e-9 * summary.total_force_nN);
}

TEST(AdhesionForces, are_off_by_no_more_than_stated_where_the_cells_network_is_another) {
  Cell cell = test::round_cell(14, 24, {{1, 13}, {4, 18}, {7, 22}});
  double stated = 0, left = 0, of_network = 0;
  int n = 0;
  for (std::uint64_t seed = 5; seed < 8; ++seed) {
    test::TensionScene scene = test::scene_of(cell, Eigen::Vector4d(0.1, 3, 5, 2), 2000, 0.01, 7, {.seed = 100 + seed});
    std::vector<cables::CableNetwork> networks;
    for (int m = 0; m < 2; ++m) networks.emplace_back(mesh::generate_network(cell, {.seed = 10 * seed + m}).network);
    const EnsembleFit fit = fit_ensemble(networks, scene.data, scene.adhesion_ids, {.loss = Loss::squares}, 2);
    const std::vector<AdhesionForce> forces = forces_of(fit, cell);
    for (std::size_t a = 0; a < forces.size(); ++a, ++n) {
      const double truth = scene.forces_nN.segment<2>(2 * static_cast<Eigen::Index>(a)).norm();
      const double error = norm(forces[a].force_nN) - truth;
      stated += std::pow(error / *forces[a].sigma_nN, 2);
      EXPECT_GT(*forces[a].sigma_nN, fit.forces.magnitudes[a].noise) << "the meshes differ, too";
    }
    left += (adhesion_forces_nN(fit) - scene.forces_nN).squaredNorm();
    of_network += (fit.forces.nN - scene.forces_nN).squaredNorm();
  }
  EXPECT_LT(stated / n, 1 + 4 * std::sqrt(2.0 / n));  // as if each told of itself
  EXPECT_LT(left, 0.8 * of_network) << "what the beads show beside the network is in them";
}

TEST(AdhesionsWithoutBeads, are_those_that_the_bead_images_do_not_show) {
  const Cell cell = test::round_cell(14, 24);
  const std::vector<Vec2> beads = test::scattered_points(2000, 50, {30, 30});  // about the cell's middle
  EXPECT_TRUE(adhesions_without_beads(cell.adhesions, beads).empty());
  // of a camera that shows a quarter, which begins at the corner; and of images binned beside others that are not
  std::vector<Vec2> quarter, half;
  for (const Vec2 p : beads) {
    if (p.x < 30 && p.y < 30) quarter.push_back(p);
    half.push_back(Vec2{-20, -20} + 0.5 * (p - Vec2{-20, -20}));
  }
  std::size_t n_outside = 0;
  for (const Adhesion& a : cell.adhesions) n_outside += a.position_um.x > 38 || a.position_um.y > 38;
  for (const auto& field : {quarter, half}) {
    const std::vector<int> ids = adhesions_without_beads(cell.adhesions, field);
    EXPECT_GE(ids.size(), n_outside);
    EXPECT_LT(ids.size(), cell.adhesions.size());
  }
}

double figure(const Figures& figures, const std::string& name) {
  for (const auto& [known, value] : figures)
    if (known == name) return std::get<double>(value);
  return std::numeric_limits<double>::quiet_NaN();
}

/// Discs far apart on a gel that is much thicker than they are large: the mean displacement under an even tangential
/// traction is 16 (1+ν)(1−ν/2) F / (3π² a E) (Johnson, Contact Mechanics, 3.7: as under a pressure, with (1+ν)(1−ν/2)
/// for 1−ν²). What one disc does to another, r away, is a·3π/(8r)-fold smaller.
TEST(StrainEnergy, of_discs_far_apart_is_that_of_each_by_itself) {
  constexpr double kRadius_um = 0.5, kDistance_um = 400, kForce_nN = 3;
  const Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.4, .thickness_um = 2000};
  Cell cell;
  for (const double x : {-0.5 * kDistance_um, 0.5 * kDistance_um})
    cell.adhesions.push_back({.adhesion_id = static_cast<int>(cell.adhesions.size()) + 1,
                              .position_um = {x, 0},
                              .area_um2 = std::numbers::pi * kRadius_um * kRadius_um,
                              .major_axis_um = 2 * kRadius_um,
                              .minor_axis_um = 2 * kRadius_um});
  EnsembleFit fit;
  fit.forces.nN = Eigen::Vector4d(kForce_nN, 0, -kForce_nN, 0);
  fit.meshes.emplace_back();
  fit.meshes[0].force_derivatives = Eigen::Vector4d(1, 0, -1, 0);  // one fibre between them
  fit.meshes[0].noise_covariance_nN2 = Eigen::MatrixXd::Constant(1, 1, 0.01);
  const Figures found = energy_and_moments(fit, cell, gel, true, 1);
  const double mean_um = 16 * (1 + gel.poisson_ratio) * (1 - gel.poisson_ratio / 2) * kForce_nN /
                         (3 * std::numbers::pi * std::numbers::pi * kRadius_um * gel.youngs_modulus_kPa);
  // the rule is exact to the fifth degree, the displacement under a disc is an elliptic integral of the radius: 1 %
  EXPECT_NEAR(figure(found, "strain_energy_fJ"), kForce_nN * mean_um, 0.01 * kForce_nN * mean_um);
  // the energy grows as the square of the tension, which is known to 0.1 nN
  EXPECT_NEAR(figure(found, "strain_energy_sigma_fJ"), 2 * mean_um * 0.1, 0.01 * 2 * mean_um * 0.1);
  EXPECT_NEAR(figure(found, "contractile_moment_nN_um"), kForce_nN * kDistance_um, 1e-9);
  EXPECT_NEAR(figure(found, "contractile_moment_sigma_nN_um"), 0.1 * kDistance_um, 1e-9);
  EXPECT_NEAR(figure(found, "contractile_moment_major_nN_um"), kForce_nN * kDistance_um, 1e-9);
  EXPECT_NEAR(figure(found, "contractile_moment_minor_nN_um"), 0, 1e-9);
  EXPECT_NEAR(std::remainder(figure(found, "contractile_moment_axis_deg"), 180), 0, 1e-9);
}

/// Nobody has seen how large an assumed adhesion is: a smaller disc has more energy, of which no bead knows.
TEST(StrainEnergy, at_assumed_adhesions_is_what_the_beads_show) {
  Cell cell;
  DisplacementField beads;
  std::vector<substrate::Ellipse> discs;
  for (const double x : {-20.0, 20.0}) {
    cell.adhesions.push_back({.adhesion_id = static_cast<int>(cell.adhesions.size()) + 1,
                              .position_um = {x, 0},
                              .area_um2 = 1,
                              .major_axis_um = 1.1,
                              .minor_axis_um = 1.1,
                              .origin = AdhesionOrigin::candidate});
    for (const Vec2 d : {Vec2{2, 0}, Vec2{-2, 0}, Vec2{0, 2}, Vec2{0, -2}, Vec2{5, 5}})
      beads.push_back({.position_um = Vec2{x, 0} + d, .sigma_um = 0.01});
  }
  Eigen::MatrixXd compliance = Eigen::MatrixXd::Zero(20, 4);  // each adhesion moves the beads about it, by their order
  for (int a = 0; a < 2; ++a)
    for (int i = 0; i < 5; ++i)
      compliance(10 * a + 2 * i, 2 * a) = compliance(10 * a + 2 * i + 1, 2 * a + 1) = 0.1 * (i + 1);
  EnsembleFit fit;
  fit.data = reduce(beads, compliance);
  fit.forces.nN = Eigen::Vector4d(3, 0, -3, 0);
  fit.meshes.emplace_back();
  fit.meshes[0].force_derivatives = Eigen::Vector4d(1, 0, -1, 0);
  fit.meshes[0].noise_covariance_nN2 = Eigen::MatrixXd::Constant(1, 1, 0.01);
  const Figures found = energy_and_moments(fit, cell, {.youngs_modulus_kPa = 8.4}, true, 1);
  EXPECT_NEAR(figure(found, "strain_energy_fJ"), 0.5 * 2 * 3 * 3 * 0.25, 1e-12);  // mean of .1 to .4 um/nN
}

TEST(ContractileMoment, follows_a_cell_that_is_turned) {
  constexpr double kAngle = 0.4;
  const Eigen::Rotation2Dd turn(kAngle);
  Cell cell;
  EnsembleFit fit;
  fit.forces.nN.resize(6);
  const Eigen::Vector2d places[] = {{-20, 3}, {18, -5}, {2, 9}}, forces[] = {{5, -1}, {-6, 2}, {1, -1}};
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector2d at = turn * places[a];
    cell.adhesions.push_back({.adhesion_id = a + 1,
                              .position_um = {at.x(), at.y()},
                              .area_um2 = 1,
                              .major_axis_um = 1.2,
                              .minor_axis_um = 1});
    fit.forces.nN.segment<2>(2 * a) = turn * forces[a];
  }
  fit.meshes.emplace_back();
  fit.meshes[0].force_derivatives = Eigen::MatrixXd::Zero(6, 1);
  fit.meshes[0].noise_covariance_nN2 = Eigen::MatrixXd::Zero(1, 1);
  Eigen::Matrix2d moment = Eigen::Matrix2d::Zero();  // the forces balance: about any point
  for (int a = 0; a < 3; ++a) moment -= places[a] * forces[a].transpose();
  const double angle = 0.5 * std::atan2(moment(0, 1) + moment(1, 0), moment(0, 0) - moment(1, 1));
  const Figures found = energy_and_moments(fit, cell, {.youngs_modulus_kPa = 8.4}, false, 1);
  EXPECT_NEAR(figure(found, "contractile_moment_nN_um"), moment.trace(), 1e-9);
  EXPECT_NEAR(figure(found, "contractile_moment_axis_deg"), (angle + kAngle) * 180 / std::numbers::pi, 1e-9);
  EXPECT_TRUE(std::isnan(figure(found, "strain_energy_fJ"))) << "the gel is not the same at all depths";
}

/// A hexagon of so many edges a side on a regular triangulation, each edge a link of share 1.
Network regular_sheet(int side, double edge_um, Polygon& outline_um) {
  Network network;
  std::map<std::pair<int, int>, int> vertex_at;
  const auto place = [&](int i, int j) { return edge_um * Vec2{i + 0.5 * j, 0.5 * std::sqrt(3.0) * j}; };
  for (int j = -side; j <= side; ++j)
    for (int i = std::max(-side, -side - j); i <= std::min(side, side - j); ++i) {
      vertex_at[{i, j}] = static_cast<int>(network.vertices_um.size());
      network.vertices_um.push_back(place(i, j));
      network.adhesion_id.push_back(0);
    }
  for (const auto& [at, a] : vertex_at)
    for (const auto& [di, dj] : {std::pair{1, 0}, {0, 1}, {-1, 1}}) {
      const auto b = vertex_at.find({at.first + di, at.second + dj});
      if (b == vertex_at.end()) continue;
      network.links.push_back({std::min(a, b->second), std::max(a, b->second), 0, edge_um, 1});
    }
  network.adhesion_id[0] = 1;
  network.adhesion_id.back() = 2;
  for (const auto& [i, j] : {std::pair{side, 0}, {0, side}, {-side, side}, {-side, 0}, {0, -side}, {side, -side}})
    outline_um.push_back(place(i, j));
  return network;
}

TEST(SurfaceTension, surface_tension_of_a_regular_network_is_root_three_times_tension_over_edge) {
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
