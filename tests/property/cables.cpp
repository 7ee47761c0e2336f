#include <gtest/gtest.h>

#include <numeric>

#include "tests/support/equilibrium.h"
#include "tests/support/lattice.h"

namespace mbtfm {
namespace {

using network::CableNetwork;
using network::Equilibrium;

/// A small lattice, random tensions; forces by adhesion and their scale.
class Cables : public testing::TestWithParam<unsigned> {
 protected:
  Eigen::VectorXd forces(const Network& of, const std::vector<double>& t, network::CableParameters p = {}) const {
    const CableNetwork other(of, p);
    const Equilibrium result = other.equilibrium(t);
    test::expect_equilibrium(other, t, result);
    return other.adhesion_forces_nN(t, result);
  }
  Network net = test::lattice({.seed = GetParam()});
  CableNetwork cables{net};
  std::vector<double> tensions = test::random_tensions_nN(cables.fibre_ids().size(), GetParam());
  Equilibrium equilibrium = cables.equilibrium(tensions);
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
    const Equilibrium other = cables.equilibrium(tensions, start);
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

TEST_P(Cables, each_step_lowers_the_energy) {
  double before = std::numeric_limits<double>::infinity();
  for (int steps = 1; steps <= 20; ++steps) {
    const CableNetwork bounded(net, {.max_iterations = steps});
    const double energy = bounded.equilibrium(tensions, net.vertices_um).energy_fJ;
    EXPECT_LE(energy, before * (1 + 1e-12)) << steps;  // rounding of sums
    before = energy;
  }
}

INSTANTIATE_TEST_SUITE_P(seeds, Cables, testing::Range(1u, 6u));

}  // namespace
}  // namespace mbtfm
