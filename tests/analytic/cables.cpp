#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/equilibrium.h"

namespace mbtfm {
namespace {

using network::CableNetwork;
using network::CableParameters;

/// Links at rest where the vertices are.
Network network_of(std::vector<Vec2> vertices, std::vector<int> adhesion_id,
                   const std::vector<std::array<int, 3>>& links) {
  Network result{std::move(vertices), std::move(adhesion_id), {}};
  for (const auto& [a, b, fibre_id] : links)
    result.links.push_back({.vertex_a = a,
                            .vertex_b = b,
                            .fibre_id = fibre_id,
                            .rest_length_um = norm(result.vertices_um[b] - result.vertices_um[a])});
  return result;
}

Vec2 force_on(const CableNetwork& cables, const std::vector<double>& tensions, int vertex) {
  const network::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  return cables.reactions_nN(tensions, equilibrium)[vertex];
}

TEST(Cables, a_straight_fibre_pulls_both_adhesions_with_its_tension) {
  const CableNetwork cables(
      network_of({{0, 0}, {2, 0}, {5, 0}, {6, 0}}, {1, 0, 0, 2}, {{0, 1, 1}, {1, 2, 1}, {2, 3, 1}}));
  const std::vector<double> tensions{0.06, 7};
  // Tension is the same in all links, so none stretches; smoothing takes (eps / l)² / 2 of it.
  EXPECT_NEAR(force_on(cables, tensions, 0).x, 7, 1e-9);
  EXPECT_NEAR(force_on(cables, tensions, 3).x, -7, 1e-9);
  const Eigen::MatrixXd derivatives = cables.adhesion_force_derivatives(tensions, cables.equilibrium(tensions));
  EXPECT_NEAR(derivatives(0, 1), 1, 1e-9);
  EXPECT_NEAR(derivatives(2, 1), -1, 1e-9);
  EXPECT_NEAR(derivatives(1, 1), 0, 1e-12);
}

TEST(Cables, three_equal_cables_meet_at_the_fermat_point) {
  // Any triangle with angles below 120 degrees: from its Fermat point the sides appear under 120 degrees. The rest
  // lengths are long, so that only tension acts.
  Network net = network_of({{0, 0}, {10, 0}, {3, 7}, {5, 5}}, {1, 2, 3, 0}, {{3, 0, 0}, {3, 1, 0}, {3, 2, 0}});
  for (Link& link : net.links) link.rest_length_um = 100;
  const CableNetwork cables(net);
  const std::vector<double> tensions{2};
  const network::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  const Vec2 centre = equilibrium.positions_um[3];
  for (int i = 0; i < 3; ++i) {
    const Vec2 a = net.vertices_um[i] - centre, b = net.vertices_um[(i + 1) % 3] - centre;
    // eps is 1e-5 of the rest length: 1e-3 um, whose square is 1e-7 of that of the cables
    EXPECT_NEAR(dot(a, b) / (norm(a) * norm(b)), -0.5, 1e-6);
  }
}

TEST(Cables, a_corner_wider_than_the_fermat_angle_draws_the_junction_onto_itself) {
  // The adhesion at the origin sees the others under 150 degrees: its cable collapses and carries |sum of the others|.
  const double angle = 150 * std::numbers::pi / 180;
  Network net = network_of({{0, 0}, {8, 0}, {8 * std::cos(angle), 8 * std::sin(angle)}, {1, 1}}, {1, 2, 3, 0},
                           {{3, 0, 0}, {3, 1, 0}, {3, 2, 0}});
  for (Link& link : net.links) link.rest_length_um = 20;
  const CableNetwork cables(net);
  const std::vector<double> tensions{1};
  const network::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  const double eps = 1e-5 * 20;
  EXPECT_LE(norm(equilibrium.positions_um[3]), eps);  // f = d / sqrt(d² + eps²) = 0.52: d = 0.6 eps
  EXPECT_NEAR(equilibrium.link_force_nN[0], 2 * std::cos(angle / 2), 1e-4);
}

TEST(Cables, a_fibre_bent_around_a_corner_presses_it_with_the_sum_of_its_pulls) {
  // The corner is an adhesion of one vertex: t (n1 + n2) on it.
  const CableNetwork cables(network_of({{0, 0}, {4, 0}, {4, 3}}, {1, 2, 3}, {{0, 1, 1}, {1, 2, 1}}));
  const Vec2 corner = force_on(cables, {0, 5}, 1);
  EXPECT_NEAR(corner.x, -5, 1e-9);
  EXPECT_NEAR(corner.y, 5, 1e-9);
}

TEST(Cables, a_stretched_cable_obeys_hooke) {
  // Fibre 1 (t = 4) pulls fibre 2 (t = 1) longer until t1 = t2 + EA (l − l0) / l0: strain 3 / 50, from l0 = 5.
  const CableNetwork cables(network_of({{0, 0}, {5, 0}, {10, 0}}, {1, 0, 2}, {{0, 1, 1}, {1, 2, 2}}));
  const std::vector<double> tensions{0, 4, 1};
  const network::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  EXPECT_NEAR(equilibrium.positions_um[1].x, 5 - 5 * 3.0 / 50, 1e-8);  // eps² / l0² = 1e-10
  EXPECT_NEAR(equilibrium.link_force_nN[1], 4, 1e-8);
  // The weak fibre's tension only changes its stretch.
  const Eigen::MatrixXd derivatives = cables.adhesion_force_derivatives(tensions, equilibrium);
  EXPECT_NEAR(derivatives(0, 1), 1, 1e-8);
  EXPECT_NEAR(derivatives(0, 2), 0, 1e-8);
}

TEST(Cables, a_slack_fibre_pulls_nothing) {
  // Two fibres between the same adhesions; the second has no tension and is longer than the way.
  Network net =
      network_of({{0, 0}, {6, 0}, {3, 0}, {3, 2}}, {1, 2, 0, 0}, {{0, 2, 1}, {2, 1, 1}, {0, 3, 2}, {3, 1, 2}});
  const CableNetwork cables(net);
  // Zero stands for its limit from above: 1e-7 of the largest tension.
  EXPECT_NEAR(force_on(cables, {0, 3, 0}, 0).x, 3, 4e-7);
  EXPECT_NEAR(force_on(cables, {0, 3, 0}, 0).y, 0, 4e-7);
}

TEST(Cables, a_link_of_twice_the_share_acts_like_two) {
  const std::vector<Vec2> vertices{{0, 0}, {6, 0}, {2, 5}, {3, 2}};
  const CableNetwork two(network_of(vertices, {1, 2, 3, 0}, {{0, 3, 1}, {0, 3, 1}, {1, 3, 0}, {2, 3, 0}}));
  Network net = network_of(vertices, {1, 2, 3, 0}, {{0, 3, 1}, {1, 3, 0}, {2, 3, 0}});
  net.links[0].share = 2;
  const CableNetwork one(net, {});
  // eps depends on the mean rest length, which differs: 1e-10 of the forces
  for (int v = 0; v < 3; ++v) EXPECT_LE(norm(force_on(one, {1, 0.8}, v) - force_on(two, {1, 0.8}, v)), 1e-7);
}

}  // namespace
}  // namespace mbtfm
