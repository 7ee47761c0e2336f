
#include "pipeline/contract/errors.h"
#include "tests/support/equilibrium.h"
#include "tests/support/hard_cables.h"
#include "tests/support/hard_case.h"
#include "tests/support/lattice.h"
#include "tests/support/random_cell.h"

namespace mbtfm {
namespace {

using cables::CableNetwork;
using cables::Equilibrium;

cables::Equilibrium solved(const cables::CableNetwork& cables, const std::vector<double>& tensions) {
  const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
  test::expect_equilibrium(cables, tensions, equilibrium);
  EXPECT_TRUE(cables.adhesion_force_derivatives(tensions, equilibrium).allFinite());
  return equilibrium;
}

TEST(HardCables, without_tension_nothing_moves_and_nothing_pulls) {
  const cables::CableNetwork cables(test::lattice({}));
  const std::vector<double> tensions(cables.fibre_ids().size(), 0);
  const cables::Equilibrium equilibrium = solved(cables, tensions);
  EXPECT_EQ(equilibrium.positions_um, cables.network().vertices_um);
  EXPECT_LE(cables.adhesion_forces_nN(tensions, equilibrium).lpNorm<Eigen::Infinity>(), 1e-12);  // rounding of EA
}

TEST(HardCables, one_strong_fibre_among_weak_cables) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const cables::CableNetwork cables(test::lattice({.seed = seed}));
    std::vector<double> tensions(cables.fibre_ids().size(), 0.01);
    tensions[1] = 1000;
    solved(cables, tensions);
  }
}

TEST(HardCables, only_the_network_or_only_the_fibres_pull) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const cables::CableNetwork cables(test::lattice({.seed = seed}));
    std::vector<double> tensions(cables.fibre_ids().size(), 0);
    tensions[0] = 0.06;
    solved(cables, tensions);
    std::fill(tensions.begin(), tensions.end(), 5);
    tensions[0] = 0;
    solved(cables, tensions);
  }
}

TEST(HardCables, a_fibre_alone_collapses_in_a_slack_network_however_weakly_it_pulls) {
  const std::vector<Vec2> rim = test::on_circle(0, 360, 4);
  const cables::CableNetwork cables(test::mesh_of({rim, {{rim[1], {1, 2}}}}));
  for (const double t : {10., 0.1, 1e-3, 1e-6, 1e-9}) {
    SCOPED_TRACE(t);
    solved(cables, {0, t});
  }
}

TEST(HardCables, any_axial_stiffness) {
  for (const double axial_stiffness : {1.0, 1e2, 1e4, 1e6}) {
    SCOPED_TRACE(axial_stiffness);
    const cables::CableNetwork cables(test::lattice({.seed = 2}), {.axial_stiffness_nN = axial_stiffness});
    solved(cables, test::random_tensions_nN(cables.fibre_ids().size(), 2));
  }
}

TEST(HardCables, fewer_than_two_adhesions_have_no_equilibrium_but_a_point) {
  for (const int id : {0, 1}) {
    Network net = test::lattice({.columns = 4, .rows = 4});
    for (int& a : net.adhesion_id) a = 0;
    net.adhesion_id[0] = id;
    EXPECT_THROW(cables::CableNetwork{net}, InvalidData);
  }
}

TEST(HardCables, two_adhesions_pull_each_other) {
  Network net = test::lattice({.columns = 8, .rows = 8});
  for (int& a : net.adhesion_id) a = 0;
  net.adhesion_id.front() = 1;
  net.adhesion_id.back() = 2;
  const cables::CableNetwork cables(net);
  const std::vector<double> tensions(cables.fibre_ids().size(), 1);
  const cables::Equilibrium equilibrium = solved(cables, tensions);
  const Eigen::VectorXd f = cables.adhesion_forces_nN(tensions, equilibrium);
  const Vec2 between = net.vertices_um.back() - net.vertices_um.front();
  EXPECT_NEAR(cross({f[0], f[1]}, between), 0, 1e-6 * norm(Vec2{f[0], f[1]}) * norm(between));
  EXPECT_GT(dot({f[0], f[1]}, between), 0);
}

TEST(HardCables, adhesions_on_a_line_collapse_the_network_onto_it) {
  Network net = test::lattice({.columns = 8, .rows = 8});
  for (std::size_t v = 0; v < net.adhesion_id.size(); ++v)
    net.adhesion_id[v] = v % 8 == 0 || v % 8 == 5 ? 0 : v < 8 ? static_cast<int>(v) : 0;
  const cables::CableNetwork cables(net);
  const std::vector<double> tensions(cables.fibre_ids().size(), 1);
  const cables::Equilibrium equilibrium = solved(cables, tensions);
  // y = 0 is the line. Force t d / sqrt(d² + eps²) falls below any tension within some eps = 1.5e-5 um.
  for (const Vec2 x : equilibrium.positions_um) EXPECT_NEAR(x.y, 0, 1e-3);
}

TEST(HardCables, a_part_that_nothing_holds_collapses_to_a_point_and_pulls_nothing) {
  Network net = test::lattice({.columns = 6, .rows = 6});
  const Network loose = test::lattice({.columns = 4, .rows = 4, .n_fibres = 0});
  const int offset = static_cast<int>(net.vertices_um.size());
  for (const Vec2 x : loose.vertices_um) net.vertices_um.push_back(x + Vec2{30, 0});
  net.adhesion_id.resize(net.vertices_um.size(), 0);
  for (Link link : loose.links) {
    link.vertex_a += offset;
    link.vertex_b += offset;
    net.links.push_back(link);
  }
  const cables::CableNetwork cables(net);
  const std::vector<double> tensions = test::random_tensions_nN(cables.fibre_ids().size(), 1);
  const cables::Equilibrium equilibrium = solved(cables, tensions);
  for (std::size_t v = offset; v < net.vertices_um.size(); ++v)
    EXPECT_LE(norm(equilibrium.positions_um[v] - equilibrium.positions_um[offset]), 1e-6);
  for (std::size_t k = net.links.size() - loose.links.size(); k < net.links.size(); ++k)
    EXPECT_LE(equilibrium.link_force_nN[k], 1e-6);
}

TEST(HardCables, needle_triangles_and_fibres_close_together) {
  // Squeezed to a fifteenth in y: rows 0.087 um apart.
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    Network net = test::lattice({.n_fibres = 8, .seed = seed});
    for (Vec2& x : net.vertices_um) x.y /= 15;
    for (Link& link : net.links)
      link.rest_length_um = norm(net.vertices_um[link.vertex_b] - net.vertices_um[link.vertex_a]);
    const cables::CableNetwork cables(net);
    solved(cables, test::random_tensions_nN(cables.fibre_ids().size(), seed));
  }
}

TEST(HardCables, two_hundred_random_networks_converge_within_a_hundred_steps) {
  int most = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const int size = 5 + static_cast<int>(seed % 9);
    const cables::CableNetwork cables(
        test::lattice({.columns = size, .rows = size, .n_fibres = size / 2, .seed = seed}));
    std::vector<double> tensions = test::random_tensions_nN(cables.fibre_ids().size(), seed);
    std::mt19937 random(seed);
    for (double& t : tensions) t *= std::pow(10, static_cast<int>(random() % 7) - 4);  // 6e-6 to 1000 nN
    const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
    test::expect_equilibrium(cables, tensions, equilibrium);
    most = std::max(most, equilibrium.report.iterations);
  }
  EXPECT_LE(most, 100);
  test::came_out("at most " + std::to_string(most) + " steps");
}

class HardScene : public ::testing::TestWithParam<int> {
 protected:
  test::HardCables scene = test::hard_cables()[GetParam()];
};

// Drawing every vertex to the nearest point of a convex set makes no cable longer: a minimum lies in the adhesions'
// convex hull. A collapsed cable's smoothing leaves its ends some eps outside.
TEST_P(HardScene, converges_balances_and_stays_among_its_adhesions) {
  const cables::CableNetwork cables(scene.network, scene.parameters);
  const cables::Equilibrium equilibrium = solved(cables, scene.tensions_nN);
  const double largest_tension = *std::ranges::max_element(scene.tensions_nN);
  EXPECT_LE(equilibrium.report.last_change,
            std::max(1e-9 * largest_tension, 2e-15 * scene.parameters.axial_stiffness_nN));
  EXPECT_LE(equilibrium.report.iterations, 100);
  test::came_out(std::to_string(equilibrium.report.iterations) + " steps, " +
                 std::to_string(std::ranges::count(equilibrium.link_states, CableState::collapsed)) +
                 " cables collapsed");
  if (largest_tension == 0) return;
  double size_um = 0;
  for (const Vec2 x : scene.network.vertices_um) size_um = std::max(size_um, norm(x));
  for (int degrees = 0; degrees < 360; degrees += 10) {
    const Vec2 normal{std::cos(degrees * std::numbers::pi / 180), std::sin(degrees * std::numbers::pi / 180)};
    double furthest = -size_um, free = -size_um;
    for (std::size_t v = 0; v < equilibrium.positions_um.size(); ++v) {
      double& reached = scene.network.adhesion_id[v] != 0 ? furthest : free;
      reached = std::max(reached, dot(normal, equilibrium.positions_um[v]));
    }
    EXPECT_LE(free, furthest + 1e-3 * size_um) << degrees;
  }
}

TEST_P(HardScene, comes_to_the_same_forces_from_anywhere) {
  const cables::CableNetwork cables(scene.network, scene.parameters);
  const Eigen::VectorXd forces = cables.adhesion_forces_nN(scene.tensions_nN, solved(cables, scene.tensions_nN));
  std::vector<Vec2> start = scene.network.vertices_um;
  std::shuffle(start.begin(), start.end(), std::mt19937(1));
  if (*std::ranges::max_element(scene.tensions_nN) == 0) return;  // then any network that is not stretched is at rest
  const cables::Equilibrium other = cables.equilibrium(scene.tensions_nN, start);
  test::expect_equilibrium(cables, scene.tensions_nN, other);
  const double difference = (cables.adhesion_forces_nN(scene.tensions_nN, other) - forces).norm() / forces.norm();
  EXPECT_LE(difference, 1e-8);
  test::came_out("they differ by " + test::two_digits(difference));
}

INSTANTIATE_TEST_SUITE_P(, HardScene, ::testing::Range(0, static_cast<int>(test::hard_cables().size())),
                         [](const auto& scene) { return test::hard_cables()[scene.param].name; });

TEST(HardCables, a_part_without_adhesions_collapses_onto_a_line_that_pulls) {
  // Thesis 3.2.3: the right half of the cell is drawn onto the arc between the outermost adhesions of the left half.
  for (const test::HardCables& scene : test::hard_cables()) {
    if (scene.name != "half_without") continue;
    const cables::CableNetwork cables(scene.network);
    const cables::Equilibrium equilibrium = solved(cables, scene.tensions_nN);
    const auto n_collapsed = std::ranges::count(equilibrium.link_states, CableState::collapsed);
    EXPECT_GT(n_collapsed, 50);
    test::came_out(std::to_string(n_collapsed) + " collapsed cables, none right of the adhesions");
    for (const Vec2 x : equilibrium.positions_um) EXPECT_LE(x.x, 0.5);  // the outermost adhesions are at x = 0
  }
}

TEST(HardCables, two_hundred_random_cells_converge_within_a_hundred_steps) {
  int most = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const Cell cell = test::random_cell(
        seed, {.radius_um = 12, .n_adhesions = 20, .n_fibres = 6, .roughness = 0.15, .least_distance_um = 2});
    const cables::CableNetwork cables(mesh::generate_network(cell, {.edge_length_um = 2.5, .seed = seed}).network);
    std::vector<double> tensions = test::random_tensions_nN(cables.fibre_ids().size(), seed);
    std::mt19937 random(seed);
    for (double& t : tensions) t *= std::pow(10, static_cast<int>(random() % 7) - 4);  // 6e-6 to 1000 nN
    const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
    test::expect_equilibrium(cables, tensions, equilibrium);
    EXPECT_LE(equilibrium.report.last_change, std::max(1e-9 * *std::ranges::max_element(tensions), 2e-15 * 50));
    most = std::max(most, equilibrium.report.iterations);
  }
  EXPECT_LE(most, 100);
  test::came_out("at most " + std::to_string(most) + " steps");
}

TEST(HardCables, wrong_tensions_are_named) {
  const cables::CableNetwork cables(test::lattice({}));
  std::vector<double> tensions(cables.fibre_ids().size(), 1);
  tensions[1] = -1;
  EXPECT_THROW(cables.equilibrium(tensions), InvalidData);
  EXPECT_THROW(cables.equilibrium({1}), InvalidData);
}

}  // namespace
}  // namespace mbtfm
