/// What must hold of a simulated experiment.
#include "samples/experiment/experiment.h"
#include "network/cables/cables.h"
#include "pipeline/contract/errors.h"
#include "tests/support/test.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::drawing;
using namespace mbtfm::experiment;

/// A small cell, quick to simulate.
drawing::ScenarioParameters small_scenario() {
  drawing::ScenarioParameters p;
  p.cell.diameter_um = 30;
  p.cell.n_adhesions = 40;
  p.cell.n_ventral = 2;
  p.cell.n_dorsal = 2;
  p.cell.n_arc = 1;
  p.microscope.image_size_px = 512;
  p.beads = 800;
  return p;
}

TEST(Experiment, exerts_no_net_force_and_no_net_torque) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    drawing::ScenarioParameters p = small_scenario();
    p.seed = seed;
    const experiment::Experiment e = experiment::simulate(p, 2);
    Vec2 force;
    for (const AdhesionForce& f : e.forces) force += f.force_nN;
    // each free vertex is at rest to 1e-9 of the largest tension; some thousand of them
    EXPECT_LT(norm(force), 1e-5 * e.total_force_nN);

    const cables::CableNetwork cables(e.network);
    std::vector<double> tensions;
    for (const Tension& t : e.tensions) tensions.push_back(t.tension_nN);
    ASSERT_EQ(tensions.size(), cables.fibre_ids().size());
    const auto reactions = cables.reactions_nN(tensions, cables.equilibrium(tensions));
    double torque = 0;
    for (std::size_t v = 0; v < reactions.size(); ++v) torque += cross(e.network.vertices_um[v], reactions[v]);
    EXPECT_LT(std::abs(torque), 1e-5 * e.total_force_nN * drawing::field_um(p.microscope));
  }
}

TEST(Experiment, noise_and_beads_leave_the_cell_as_it_is) {
  const drawing::ScenarioParameters p = small_scenario();
  drawing::ScenarioParameters noisy = p;
  noisy.noise = 0.25;
  noisy.beads = 1200;
  const experiment::Experiment a = experiment::simulate(p, 1), b = experiment::simulate(noisy, 1);
  ASSERT_EQ(a.forces.size(), b.forces.size());
  for (std::size_t i = 0; i < a.forces.size(); ++i) EXPECT_TRUE(a.forces[i].force_nN == b.forces[i].force_nN);
  for (std::size_t i = 0; i < a.displacement.size(); ++i)
    EXPECT_TRUE(a.displacement[i].position_um == b.displacement[i].position_um) << "bead " << i;
}

TEST(Experiment, noise_has_the_standard_deviation_asked_for) {
  drawing::ScenarioParameters p = small_scenario();
  p.noise = 0.1;
  p.beads = 4000;
  const experiment::Experiment e = experiment::simulate(p, 2);
  double squares = 0, largest = 0;
  for (std::size_t i = 0; i < e.measured.size(); ++i) {
    const Vec2 error = e.measured[i].displacement_um - e.displacement[i].displacement_um;
    squares += dot(error, error);
    largest = std::max(largest, norm(e.displacement[i].displacement_um));
    EXPECT_EQ(e.measured[i].sigma_um, e.noise_um);
  }
  EXPECT_DOUBLE_EQ(e.noise_um, 0.1 * largest);
  const double n = 2.0 * static_cast<double>(e.measured.size());
  EXPECT_NEAR(std::sqrt(squares / n), e.noise_um, 4 * e.noise_um / std::sqrt(2 * n));
}

TEST(Experiment, the_gel_moves_towards_the_middle_of_a_cell_that_contracts) {
  drawing::ScenarioParameters p = small_scenario();
  p.noise = 0;
  const experiment::Experiment e = experiment::simulate(p, 2);
  const Vec2 centre{0.5 * drawing::field_um(p.microscope), 0.5 * drawing::field_um(p.microscope)};
  double inward = 0;
  for (const Bead& bead : e.measured) inward += dot(bead.displacement_um, centre - bead.position_um);
  EXPECT_GT(inward, 0) << "displacement is stressed minus relaxed position";
  double pinch = 0;
  for (std::size_t i = 0; i < e.forces.size(); ++i)
    pinch += dot(e.forces[i].force_nN, centre - e.cell.adhesions[i].position_um);
  EXPECT_GT(pinch, 0) << "forces are those of the cell on the gel";
}

TEST(Experiment, its_network_has_the_surface_tension_asked_for_on_any_mesh) {
  for (const double edge_um : {0.7, 1.4}) {
    drawing::ScenarioParameters p = small_scenario();
    p.mechanics.simulation_edge_length_um = edge_um;
    const experiment::Experiment e = experiment::simulate(p, 2);
    double sum = 0;  // half the trace of the network's stress times its area
    for (const Link& link : e.network.links)
      if (link.fibre_id == 0) sum += 0.5 * link.share * e.tensions.front().tension_nN * link.rest_length_um;
    const double tension = sum / std::abs(signed_area_um2(e.cell.outline_um));
    // fibres take the place of some per cent of the network's links, and so do links at the border
    EXPECT_NEAR(tension / p.tension.surface_tension_nN_per_um, 1, 0.15) << "edge " << edge_um;
  }
}

TEST(Beads, keep_their_distance_or_say_that_they_cannot) {
  drawing::ScenarioParameters p = small_scenario();
  p.bead_distance_um = 0.8;
  const std::vector<Vec2> beads = experiment::place_beads(p);
  ASSERT_EQ(static_cast<int>(beads.size()), p.beads);
  for (std::size_t i = 0; i < beads.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) ASSERT_GE(norm(beads[i] - beads[j]), 0.8);
  p.bead_distance_um = 5;
  EXPECT_THROW(experiment::place_beads(p), UsageError);
}

TEST(TwoAdhesions, feel_the_tension_of_the_fibre_between_them_where_the_network_is_weak) {
  drawing::ScenarioParameters p = small_scenario();
  p.cell.layout = drawing::Layout::line;
  p.cell.n_adhesions = 2;
  p.cell.elongation = 8;
  p.cell.adhesion_area_um2 = 1;
  p.tension.surface_tension_nN_per_um = 1e-5;
  const experiment::Experiment e = experiment::simulate(p, 1);
  ASSERT_EQ(e.forces.size(), 2u);
  // the network adds its tension by width over the 4 um of the spindle, 4e-5 nN, some times that where its cables
  // have lined up with the fibre
  const double tension = p.tension.ventral_median_nN;
  EXPECT_NEAR(e.forces[0].force_nN.x, tension, 4e-4);
  EXPECT_NEAR(e.forces[1].force_nN.x, -tension, 4e-4);
  EXPECT_NEAR(e.forces[0].force_nN.y, 0, 4e-4);
}

}  // namespace
