#include <Eigen/Dense>

#include "network/mesh/mesh.h"
#include "tests/support/equilibrium.h"

namespace mbtfm {
namespace {

using cables::CableNetwork;
using cables::CableParameters;

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

Vec2 force_on(const cables::CableNetwork& cables, const std::vector<double>& tensions, int vertex) {
  const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  return cables.reactions_nN(tensions, equilibrium)[vertex];
}

TEST(Cables, a_straight_fibre_pulls_both_adhesions_with_its_tension) {
  const cables::CableNetwork cables(
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
  const cables::CableNetwork cables(net);
  const std::vector<double> tensions{2};
  const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
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
  const cables::CableNetwork cables(net);
  const std::vector<double> tensions{1};
  const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  const double eps = 1e-5 * 20;
  EXPECT_LE(norm(equilibrium.positions_um[3]), eps);  // f = d / sqrt(d² + eps²) = 0.52: d = 0.6 eps
  EXPECT_NEAR(equilibrium.link_force_nN[0], 2 * std::cos(angle / 2), 1e-4);
}

TEST(Cables, a_fibre_bent_around_a_corner_presses_it_with_the_sum_of_its_pulls) {
  // The corner is an adhesion of one vertex: t (n1 + n2) on it.
  const cables::CableNetwork cables(network_of({{0, 0}, {4, 0}, {4, 3}}, {1, 2, 3}, {{0, 1, 1}, {1, 2, 1}}));
  const Vec2 corner = force_on(cables, {0, 5}, 1);
  EXPECT_NEAR(corner.x, -5, 1e-9);
  EXPECT_NEAR(corner.y, 5, 1e-9);
}

TEST(Cables, a_stretched_cable_obeys_hooke) {
  // Fibre 1 (t = 4) pulls fibre 2 (t = 1) longer until t1 = t2 + EA (l − l0) / l0: strain 3 / 50, from l0 = 5.
  const cables::CableNetwork cables(network_of({{0, 0}, {5, 0}, {10, 0}}, {1, 0, 2}, {{0, 1, 1}, {1, 2, 2}}));
  const std::vector<double> tensions{0, 4, 1};
  const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
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
  const cables::CableNetwork cables(net);
  // Zero stands for its limit from above: 1e-7 of the largest tension.
  EXPECT_NEAR(force_on(cables, {0, 3, 0}, 0).x, 3, 4e-7);
  EXPECT_NEAR(force_on(cables, {0, 3, 0}, 0).y, 0, 4e-7);
}

TEST(Cables, a_link_of_twice_the_share_acts_like_two) {
  const std::vector<Vec2> vertices{{0, 0}, {6, 0}, {2, 5}, {3, 2}};
  const cables::CableNetwork two(network_of(vertices, {1, 2, 3, 0}, {{0, 3, 1}, {0, 3, 1}, {1, 3, 0}, {2, 3, 0}}));
  Network net = network_of(vertices, {1, 2, 3, 0}, {{0, 3, 1}, {1, 3, 0}, {2, 3, 0}});
  net.links[0].share = 2;
  const cables::CableNetwork one(net, {});
  const std::vector<double> short_of_rest{1, 0.8}, stretched{6, 0.1};
  EXPECT_GT(one.equilibrium(stretched).link_force_nN[0], 2 * 2 * 0.1) << "it is to be pulled beyond its rest length";
  for (const auto& tensions : {short_of_rest, stretched}) {
    // eps depends on the mean rest length, which differs: 1e-10 of the forces
    for (int v = 0; v < 3; ++v) EXPECT_LE(norm(force_on(one, tensions, v) - force_on(two, tensions, v)), 1e-7);
  }
}

/// Radius of the circle nearest to the points (Kåsa, IEEE Trans. Instrum. Meas. 25 (1976) 8).
double radius_of(const std::vector<Vec2>& points) {
  Eigen::MatrixXd rows(points.size(), 3);
  Eigen::VectorXd squares(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    rows.row(i) << points[i].x, points[i].y, 1;
    squares[i] = dot(points[i], points[i]);
  }
  const Eigen::Vector3d c = rows.colPivHouseholderQr().solve(squares);
  return std::sqrt(c[2] + 0.25 * (c[0] * c[0] + c[1] * c[1]));
}

/// A sheet of 20 × 10 um, held along three sides; a fibre runs along the fourth. Rest lengths are long: nothing is
/// taut.
/// @returns radius of the free edge over line tension / surface tension, where the latter is `law_radius_um`
double free_edge_radius_over_law(double edge_um, std::uint64_t seed, double law_radius_um) {
  Cell cell;
  cell.outline_um = {{0, 0}, {20, 0}, {20, 10}, {0, 10}};
  for (const Vec2 corner : cell.outline_um) {
    Adhesion a;
    a.adhesion_id = static_cast<int>(cell.adhesions.size()) + 1;
    a.position_um = corner;
    a.area_um2 = 1e-4;
    a.major_axis_um = a.minor_axis_um = std::sqrt(4e-4 / std::numbers::pi);
    cell.adhesions.push_back(a);
  }
  Network net = mesh::generate_network(cell, {.edge_length_um = edge_um, .seed = seed}).network;
  std::vector<int> edge;
  for (int v = 0; v < static_cast<int>(net.vertices_um.size()); ++v) {
    const Vec2 x = net.vertices_um[v];
    net.adhesion_id[v] = x.y < 1e-9 ? 1 : x.x < 1e-9 ? 2 : x.x > 20 - 1e-9 ? 3 : 0;
    if (x.y > 10 - 1e-9) edge.push_back(v);
  }
  std::sort(edge.begin(), edge.end(), [&](int a, int b) { return net.vertices_um[a].x < net.vertices_um[b].x; });
  for (std::size_t i = 1; i < edge.size(); ++i)
    net.links.push_back({.vertex_a = edge[i - 1], .vertex_b = edge[i], .fibre_id = 1, .rest_length_um = edge_um});
  for (Link& link : net.links) link.rest_length_um *= 100;
  const cables::CableNetwork cables(net);
  const double surface_tension = 0.1;  // nN/um
  const std::vector<double> tensions{surface_tension * edge_um / std::sqrt(3.0), surface_tension * law_radius_um};
  const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  std::vector<Vec2> arc;
  for (const int v : edge) arc.push_back(equilibrium.positions_um[v]);
  return radius_of(arc) / law_radius_um;
}

// Bischofs, Schmidt & Schwarz, Phys. Rev. Lett. 103 (2009) 048101. With links weighted by width a sheet's energy is
// surface tension times area to first order in the strain, on any mesh: the law is exact for a flat arc, and what is
// left is the strain, sagitta over the sheet's height: (20 um)² / (8 R) / 10 um = 5 um / R, times a factor of order 1.
TEST(Cables, a_free_edge_is_an_arc_of_radius_line_tension_over_surface_tension) {
  for (const double edge_um : {2.0, 1.0})
    for (const std::uint64_t seed : {1, 2}) {
      double before = 1;
      for (const double radius_um : {50.0, 500.0, 5000.0}) {
        const double error = std::abs(free_edge_radius_over_law(edge_um, seed, radius_um) - 1);
        EXPECT_LE(error, 10 / radius_um);
        EXPECT_LE(error, before / 5);  // first order: a tenth
        before = error;
      }
    }
}

}  // namespace
}  // namespace mbtfm
