#include "pipeline/numerics/parallel.h"
#include "tests/support/equilibrium.h"
#include "tests/support/lattice.h"

namespace mbtfm {
namespace {

using cables::CableNetwork;
using cables::Equilibrium;

/// Links of unequal width: each has its share of tension and stiffness.
Network with_unequal_shares(Network net, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0.5, 1);
  for (Link& link : net.links) link.share = share(random);
  return net;
}

/// A small lattice, random tensions; forces by adhesion and their scale.
class Cables : public testing::TestWithParam<unsigned> {
 protected:
  Eigen::VectorXd forces(const Network& of, const std::vector<double>& t, cables::CableParameters p = {}) const {
    const cables::CableNetwork other(of, p);
    const cables::Equilibrium result = other.equilibrium(t);
    test::expect_equilibrium(other, t, result);
    return other.adhesion_forces_nN(t, result);
  }
  Network net = with_unequal_shares(test::lattice({.seed = GetParam()}), GetParam());
  cables::CableNetwork cables{net};
  std::vector<double> tensions = test::random_tensions_nN(cables.fibre_ids().size(), GetParam());
  cables::Equilibrium equilibrium = cables.equilibrium(tensions);
  Eigen::VectorXd reference = cables.adhesion_forces_nN(tensions, equilibrium);
  // A residual of 1e-9 of the tensions moves soft parts of a network by up to 1e3 as much (EA / t); the last Newton
  // step brings it far lower, so this is generous.
  double tolerance = 1e-8 * reference.lpNorm<Eigen::Infinity>();
};

TEST_P(Cables, exert_no_net_force_and_no_net_torque) { test::expect_equilibrium(cables, tensions, equilibrium); }

TEST_P(Cables, rotated_and_moved_networks_have_rotated_forces) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  Network turned = net;
  for (Vec2& x : turned.vertices_um) x = Vec2{c * x.x - s * x.y, s * x.x + c * x.y} + Vec2{30, -20};
  const Eigen::VectorXd f = forces(turned, tensions);
  for (Eigen::Index i = 0; i < f.size(); i += 2) {
    EXPECT_NEAR(f[i], c * reference[i] - s * reference[i + 1], tolerance);
    EXPECT_NEAR(f[i + 1], s * reference[i] + c * reference[i + 1], tolerance);
  }
}

TEST_P(Cables, forces_do_not_depend_on_the_unit_of_length) {
  for (const double scale : {1e3, 1e-3}) {  // nm and mm
    Network scaled = net;
    for (Vec2& x : scaled.vertices_um) x = scale * x;
    for (Link& link : scaled.links) link.rest_length_um *= scale;
    EXPECT_LE((forces(scaled, tensions) - reference).lpNorm<Eigen::Infinity>(), tolerance) << scale;
  }
}

TEST_P(Cables, forces_scale_with_tensions_and_axial_stiffness) {
  std::vector<double> scaled = tensions;
  for (double& t : scaled) t *= 1e3;
  const Eigen::VectorXd f = forces(net, scaled, {.axial_stiffness_nN = 50e3});
  EXPECT_LE((f / 1e3 - reference).lpNorm<Eigen::Infinity>(), tolerance);
}

TEST_P(Cables, the_order_of_the_vertices_and_links_does_not_matter) {
  std::mt19937 random(GetParam());
  std::vector<int> place(net.vertices_um.size());
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), random);
  Network permuted = net;
  for (std::size_t v = 0; v < place.size(); ++v) {
    permuted.vertices_um[place[v]] = net.vertices_um[v];
    permuted.adhesion_id[place[v]] = net.adhesion_id[v];
  }
  for (Link& link : permuted.links) {
    link.vertex_a = place[link.vertex_a];
    link.vertex_b = place[link.vertex_b];
  }
  std::shuffle(permuted.links.begin(), permuted.links.end(), random);
  EXPECT_LE((forces(permuted, tensions) - reference).lpNorm<Eigen::Infinity>(), tolerance);
}

TEST_P(Cables, any_start_leads_to_the_same_equilibrium) {
  std::mt19937 random(GetParam());
  std::uniform_real_distribution<double> anywhere(-20, 40);
  for (int trial = 0; trial < 3; ++trial) {
    std::vector<Vec2> start = net.vertices_um;
    for (Vec2& x : start) x = {anywhere(random), anywhere(random)};
    const cables::Equilibrium other = cables.equilibrium(tensions, start);
    test::expect_equilibrium(cables, tensions, other);
    EXPECT_LE((cables.adhesion_forces_nN(tensions, other) - reference).lpNorm<Eigen::Infinity>(), tolerance);
  }
}

// Central differences with step s err by s² R''' / 6 + rounding / s, and by a kink (a cable that begins to stretch)
// within the step; s = 1e-5 nN leaves 1e-8 / 1e-5 of rounding at the most pessimistic.
TEST_P(Cables, derivatives_agree_with_central_differences) {
  const Eigen::MatrixXd derivatives = cables.adhesion_force_derivatives(tensions, equilibrium);
  const double step = 1e-5;
  for (std::size_t g = 0; g < tensions.size(); ++g) {
    const auto shifted = [&](double by) {
      std::vector<double> t = tensions;
      t[g] += by;
      return cables.adhesion_forces_nN(t, cables.equilibrium(t, equilibrium.positions_um));
    };
    const Eigen::VectorXd difference = (shifted(step) - shifted(-step)) / (2 * step);
    EXPECT_LE((derivatives.col(g) - difference).norm(), 1e-4 * derivatives.col(g).norm()) << "group " << g;
  }
}

TEST_P(Cables, derivatives_exert_no_net_force_and_no_net_torque) {
  const Eigen::MatrixXd derivatives = cables.adhesion_force_derivatives(tensions, equilibrium);
  for (Eigen::Index g = 0; g < derivatives.cols(); ++g) {
    std::vector<Vec2> forces(net.vertices_um.size());
    for (std::size_t v = 0; v < forces.size(); ++v)
      if (const int id = net.adhesion_id[v]; id > 0)
        forces[v] = {derivatives(2 * id - 2, g), derivatives(2 * id - 1, g)};
    // The condition of H times rounding; H spans EA / t and 1 / smoothing.
    EXPECT_LE(norm(test::net_force_nN(forces)), 1e-8 * test::largest(forces));
    EXPECT_LE(std::abs(test::net_torque(net.vertices_um, forces)), 1e-7 * test::largest(forces) * 20);
  }
}

TEST_P(Cables, geometry_gradients_agree_with_central_differences) {
  std::mt19937 random(GetParam());
  std::normal_distribution<double> normal;
  const Eigen::VectorXd weights = Eigen::VectorXd::NullaryExpr(reference.size(), [&] { return normal(random); });
  const cables::GeometryGradient gradient = cables.geometry_gradient(tensions, equilibrium, weights);
  const auto sum = [&](const Network& other) {
    const cables::CableNetwork changed(other);
    return weights.dot(changed.adhesion_forces_nN(tensions, changed.equilibrium(tensions, equilibrium.positions_um)));
  };
  const double step = 1e-5, scale = gradient.by_held_vertex.lpNorm<Eigen::Infinity>();
  for (std::size_t h = 0; h < cables.held_vertices().size(); h += 3) {
    const int v = cables.held_vertices()[h];
    const auto moved = [&](double by) {  // along x; every cable that ends there keeps its strain
      Network other = net;
      other.vertices_um[v].x += by;
      for (std::size_t k = 0; k < net.links.size(); ++k) {
        if (net.links[k].vertex_a != v && net.links[k].vertex_b != v) continue;
        const Vec2 span = equilibrium.spans_um[k], after{span.x + (net.links[k].vertex_b == v ? by : -by), span.y};
        if (norm(span) > 1e-3) other.links[k].rest_length_um *= norm(after) / norm(span);
      }
      return other;
    };
    const double difference = (sum(moved(step)) - sum(moved(-step))) / (2 * step);
    EXPECT_NEAR(gradient.by_held_vertex(2 * static_cast<Eigen::Index>(h), 0), difference, 1e-4 * scale)
        << "vertex " << v;
  }
  for (std::size_t k = 0; k < net.links.size(); k += 40) {
    if (equilibrium.link_states[k] != CableState::slack) continue;  // there a larger share is more tension, no more
    const double tension = tensions[net.links[k].fibre_id];
    const auto pulled = [&](double by) {
      Network other = net;
      other.links[k].share += by / tension;
      return other;
    };
    const double difference = (sum(pulled(step)) - sum(pulled(-step))) / (2 * step);
    EXPECT_NEAR(gradient.by_link(static_cast<Eigen::Index>(k), 0), difference,
                1e-4 * gradient.by_link.lpNorm<Eigen::Infinity>())
        << "link " << k;
  }
}

TEST_P(Cables, each_step_lowers_the_energy) {
  double before = std::numeric_limits<double>::infinity();
  for (int steps = 1; steps <= 20; ++steps) {
    const cables::CableNetwork bounded(net, {.max_iterations = steps});
    const double energy = bounded.equilibrium(tensions, net.vertices_um).energy_fJ;
    EXPECT_LE(energy, before * (1 + 1e-12)) << steps;  // rounding of sums
    before = energy;
  }
}

TEST_P(Cables, conjugate_gradients_find_the_same_minimum) {
  const Eigen::VectorXd f = forces(net, tensions, {.contraction = cables::Contraction::conjugate_gradient});
  EXPECT_LE((f - reference).lpNorm<Eigen::Infinity>(), tolerance);
}

TEST_P(Cables, forces_do_not_depend_on_the_smoothing_down_to_a_millionth_of_an_edge) {
  // Rounding a kink off over eps moves the ends of collapsed cables by about eps: a force of (EA / l0) eps each.
  const Eigen::VectorXd sharpest = forces(net, tensions, {.smoothing = 1e-8});
  for (const double smoothing : {1e-3, 1e-4, 1e-5, 1e-6})
    EXPECT_LE((forces(net, tensions, {.smoothing = smoothing}) - sharpest).lpNorm<Eigen::Infinity>(), 50 * smoothing)
        << smoothing;
}

TEST_P(Cables, are_taut_slack_or_collapsed_as_their_forces_show) {
  for (std::size_t k = 0; k < net.links.size(); ++k) {
    const Link& link = net.links[k];
    const double tension = link.share * tensions[link.fibre_id];  // groups of the lattice are numbered as its fibres
    const double length = norm(equilibrium.spans_um[k]), force = equilibrium.link_force_nN[k];
    switch (equilibrium.link_states[k]) {
      case CableState::taut:
        EXPECT_NEAR(force, tension + link.share * 50 * (length / link.rest_length_um - 1), 1e-8 * (1 + force));
        EXPECT_GT(length, link.rest_length_um);
        break;
      case CableState::slack:
        EXPECT_NEAR(force, tension, 0.005 * tension);  // collapsed: by more
        EXPECT_LE(length, link.rest_length_um * (1 + 1e-11));
        break;
      case CableState::collapsed:
        EXPECT_LT(force, tension);
        EXPECT_LE(length, 1e-4 * 1.5);
    }
  }
}

TEST_P(Cables, derivatives_by_vertex_add_up_to_those_by_adhesion_and_exert_no_torque) {
  Network shared = net;  // adhesions of several vertices: each has a moment of its own
  for (int& id : shared.adhesion_id) id = id == 0 ? 0 : 1 + id % 4;
  const cables::CableNetwork few(shared);
  const cables::Equilibrium e = few.equilibrium(tensions);
  test::expect_equilibrium(few, tensions, e);
  const Eigen::MatrixXd by_vertex = few.reaction_derivatives(tensions, e);
  Eigen::MatrixXd sum = few.adhesion_force_derivatives(tensions, e);
  ASSERT_EQ(sum.rows(), 8);
  for (Eigen::Index g = 0; g < sum.cols(); ++g) {
    double torque = 0;
    for (std::size_t i = 0; i < few.held_vertices().size(); ++i) {
      const int v = few.held_vertices()[i];
      const Vec2 f{by_vertex(2 * i, g), by_vertex(2 * i + 1, g)};
      torque += cross(shared.vertices_um[v], f);
      sum(2 * (shared.adhesion_id[v] - 1), g) -= f.x;
      sum(2 * (shared.adhesion_id[v] - 1) + 1, g) -= f.y;
    }
    EXPECT_LE(std::abs(torque), 1e-7 * 20 * by_vertex.col(g).norm());  // the condition of H times rounding
  }
  EXPECT_LE(sum.norm(), 1e-12 * by_vertex.norm());
}

/// A hexagon of a triangular lattice, held at its corners and drawn by three fibres through its centre.
Network hexagon(int n, double edge_um) {
  Network result;
  std::map<std::pair<int, int>, int> vertex;  // by lattice coordinates
  for (int i = -n; i <= n; ++i)
    for (int j = std::max(-n, -n - i); j <= std::min(n, n - i); ++j) {
      vertex[{i, j}] = static_cast<int>(result.vertices_um.size());
      result.vertices_um.push_back({edge_um * (i + 0.5 * j), edge_um * std::sqrt(0.75) * j});
      result.adhesion_id.push_back(0);
    }
  const int corners[6][2] = {{n, 0}, {0, n}, {-n, n}, {-n, 0}, {0, -n}, {n, -n}};
  for (int c = 0; c < 6; ++c) result.adhesion_id[vertex[{corners[c][0], corners[c][1]}]] = c + 1;
  for (const auto& [at, a] : vertex)
    for (const auto& [di, dj] : {std::pair(1, 0), std::pair(0, 1), std::pair(-1, 1)}) {
      const auto other = vertex.find({at.first + di, at.second + dj});
      if (other == vertex.end()) continue;
      const bool through_centre = di == 1 ? at.second == 0 : di == 0 ? at.first == 0 : at.first + at.second == 0;
      const int fibre = through_centre ? (di == 1 ? 1 : di == 0 ? 2 : 3) : 0;
      result.links.push_back({.vertex_a = a, .vertex_b = other->second, .fibre_id = fibre, .rest_length_um = edge_um});
    }
  return result;
}

TEST(SymmetricCables, symmetric_cells_have_symmetric_forces) {
  for (const double t_fibre : {0.06, 3.0}) {
    const cables::CableNetwork cables(hexagon(6, 1.5));
    const std::vector<double> tensions{0.06, t_fibre, t_fibre, t_fibre};
    const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
    test::expect_equilibrium(cables, tensions, equilibrium);
    const Eigen::VectorXd f = cables.adhesion_forces_nN(tensions, equilibrium);
    for (int c = 0; c < 6; ++c) {  // towards the centre, all the same
      const double angle = c * std::numbers::pi / 3;
      EXPECT_NEAR(f[2 * c], f[0] * std::cos(angle), 1e-8 * std::abs(f[0]));
      EXPECT_NEAR(f[2 * c + 1], f[0] * std::sin(angle), 1e-8 * std::abs(f[0]));
    }
    EXPECT_LT(f[0], 0);
  }
}

// Networks of more than 4 000 free vertices are ordered by nested dissection, which draws random numbers.
TEST(LargeCables, balance_and_come_to_the_same_bytes_when_prepared_at_once) {
  const Network net = test::lattice({.columns = 70, .rows = 70, .seed = 3});
  std::vector<Eigen::VectorXd> forces(4);
  const auto contract = [&](int i) {
    const cables::CableNetwork cables(net);
    const std::vector<double> t = test::random_tensions_nN(cables.fibre_ids().size(), 3);
    const cables::Equilibrium equilibrium = cables.equilibrium(t);
    if (i == 0) test::expect_equilibrium(cables, t, equilibrium);
    forces[i] = cables.adhesion_forces_nN(t, equilibrium);
  };
  contract(0);
  numerics::parallel_for(3, 3, [&](int i) { contract(i + 1); });
  for (int i = 1; i < 4; ++i) EXPECT_EQ(forces[i], forces[0]);
}

INSTANTIATE_TEST_SUITE_P(seeds, Cables, testing::Range(1u, 6u));

}  // namespace
}  // namespace mbtfm
