/// Simulated cells that the image cuts, against the truth of the whole cell.
#include <Eigen/LU>

#include "mbtfm/tensions/findings.h"
#include "mbtfm/tensions/fit_results.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "samples/drawing/scenario.h"
#include "samples/experiment/experiment.h"
#include "tests/support/cut_cell.h"

namespace mbtfm {
namespace {

using test::Beyond;
using test::CutCell;
using test::CutFit;
using test::Window;

/// A small cell that the image cuts at its left third, and its beads.
struct Scene {
  experiment::Experiment experiment;
  Gel gel;
  Window window;
  CutCell cut;
  DisplacementField beads;
};

Scene scene(std::uint64_t seed, double part = 0.35) {
  drawing::ScenarioParameters p;
  p.seed = seed;
  p.beads = 4000;
  Scene s{.experiment = experiment::simulate(p, 2), .gel = p.gel, .window = {{-1e4, -1e4}, {1e4, 1e4}}};
  double low = 1e9, high = -1e9;
  for (const Vec2 q : s.experiment.cell.outline_um) {
    low = std::min(low, q.x);
    high = std::max(high, q.x);
  }
  s.window.low_um.x = low + part * (high - low);
  s.cut = test::cut_cell(s.experiment.cell, s.experiment.forces, s.window);
  s.beads = test::beads_in(s.experiment.measured, s.window);
  for (Bead& bead : s.beads) bead.sigma_um = s.experiment.noise_um;
  return s;
}

double true_tension(const Scene& s, int fibre_id) {
  return std::ranges::find(s.experiment.tensions, fibre_id, &Tension::fibre_id)->tension_nN;
}

TEST(CutCells, tensions_forces_and_the_force_through_the_cut_are_found_within_their_errors) {
  constexpr int kCells = 4;
  int n_tensions = 0, n_covered = 0, n_forces = 0, n_forces_covered = 0;
  double squares = 0, error = 0, error_if_ignored = 0, of_totals = 0;
  std::ostringstream cells;
  for (std::uint64_t seed = 41; seed < 41 + kCells; ++seed) {
    const Scene s = scene(seed);
    const CutFit found = test::fit_cut(s.cut.cell, s.beads, s.gel, 2),
                 blind = test::fit_cut(s.cut.cell, s.beads, s.gel, 2, Beyond::ignored);
    ASSERT_TRUE(found.fit.cut.has_value());
    const auto tensions = tensions::tensions_of(found.fit);
    for (std::size_t i = 1; i < tensions.size(); ++i) {
      if (!tensions[i].identifiable) continue;
      const double truth = true_tension(s, tensions[i].fibre_id);
      ++n_tensions;
      n_covered += *tensions[i].low_nN <= truth && truth <= tensions[i].high_nN.value_or(1e9);
      const auto over_sigma = [&](const tensions::Estimate& e) { return (e.value - truth) / e.standard_error; };
      error += std::pow(over_sigma(found.fit.tensions.nN[i]), 2);
      error_if_ignored += std::pow(over_sigma(blind.fit.tensions.nN[i]), 2);
    }
    const Eigen::VectorXd forces = tensions::adhesion_forces_nN(found.fit);
    for (std::size_t a = 0; a < s.cut.cell.adhesions.size(); ++a) {
      const int id = s.cut.cell.adhesions[a].adhesion_id;
      if (s.cut.share_inside.at(id) < 1) continue;
      const Vec2 truth = std::ranges::find(s.experiment.forces, id, &AdhesionForce::adhesion_id)->force_nN;
      const Eigen::Vector2d f = forces.segment<2>(2 * static_cast<Eigen::Index>(a));
      const tensions::Estimate& e = found.fit.forces.magnitudes[a];
      ++n_forces;
      n_forces_covered += std::abs(f.norm() - f.normalized().dot(Eigen::Vector2d(truth.x, truth.y))) <=
                          tensions::interval_95(e).high - e.value;
    }
    double total_nN = 0;
    for (const Adhesion& a : s.cut.cell.adhesions)
      total_nN += s.cut.share_inside.at(a.adhesion_id) *
                  norm(std::ranges::find(s.experiment.forces, a.adhesion_id, &AdhesionForce::adhesion_id)->force_nN);
    of_totals += (found.fit.total_force_nN.value - total_nN) / found.fit.total_force_nN.standard_error;
    const tensions::CutForce& c = *found.fit.cut;
    squares += std::pow((c.x_nN.value - s.cut.outside_nN.x) / c.x_nN.standard_error, 2) +
               std::pow((c.y_nN.value - s.cut.outside_nN.y) / c.y_nN.standard_error, 2);
    cells << "seed " << seed << ": through the cut " << c.x_nN.value << " +- " << c.x_nN.standard_error << ", "
          << c.y_nN.value << " +- " << c.y_nN.standard_error << " of " << s.cut.outside_nN.x << ", "
          << s.cut.outside_nN.y << " nN\n";
    EXPECT_LT(tensions::imbalance_of(found.fit).force, 1e-6) << seed;
    EXPECT_LT(tensions::imbalance_of(found.fit).torque, 1e-6) << seed;
  }
  // 95 % of some 60 tensions: .90 less two standard deviations of chance; of some 400 forces chance is 1 %
  EXPECT_GE(n_covered, 0.83 * n_tensions);
  EXPECT_GE(n_forces_covered, 0.90 * n_forces);
  // of 8 standard normal numbers the mean square is above 3.3 in one case of a thousand
  EXPECT_LE(squares / (2 * kCells), 3.3) << cells.str();
  EXPECT_LT(error, error_if_ignored) << cells.str();
  // the mean of four standard normal numbers is beyond 1.3 in one case of a hundred
  EXPECT_LT(std::abs(of_totals / kCells), 1.3);
}

/// docs/theory/fit.md, "A cell that the image cuts".
TEST(CutCells, own_forces_of_adhesions_are_expected_near_the_cut_and_fade_away_from_it) {
  const Scene s = scene(41);
  const CutFit found = test::fit_cut(s.cut.cell, s.beads, s.gel, 2);
  const Eigen::MatrixXd& own = found.fit.data.motions.forces;
  int n_near = 0, n_far = 0;
  for (std::size_t a = 0; a < s.cut.cell.adhesions.size(); ++a) {
    const Adhesion& adhesion = s.cut.cell.adhesions[a];
    const double from_cut_um = adhesion.position_um.x - s.window.low_um.x - 0.5 * adhesion.major_axis_um;
    const double size = own.row(2 * static_cast<Eigen::Index>(a)).norm(), largest = own.cwiseAbs().maxCoeff();
    if (from_cut_um < 3) {
      EXPECT_NEAR(size, largest, 1e-9 * largest);
      ++n_near;
    } else if (from_cut_um < 24) {
      EXPECT_NEAR(size, 0.23 * std::exp(-from_cut_um / 10) * largest, 0.02 * largest);  // the cut has ends
      ++n_far;
    } else if (from_cut_um > 26) {
      EXPECT_EQ(size, 0);
    }
  }
  EXPECT_GT(n_near, 0);
  EXPECT_GT(n_far, 0);
}

TEST(CutCells, finer_places_change_nothing) {
  const Scene s = scene(42);
  const CutFit a = test::fit_cut(s.cut.cell, s.beads, s.gel, 2);
  const CutFit b = test::fit_cut(s.cut.cell, s.beads, s.gel, 2, Beyond::allowed, {.finest = 0.5, .growth = 0.5});
  EXPECT_GT(b.beyond->n_places, 2 * a.beyond->n_places);
  double squares = 0, n = 0;
  for (std::size_t i = 1; i < a.fit.tensions.nN.size(); ++i, n += 1) {
    const double error = a.fit.tensions.nN[i].standard_error;
    squares += std::pow((a.fit.tensions.nN[i].value - b.fit.tensions.nN[i].value) / error, 2);
  }
  EXPECT_LT(std::sqrt(squares / n), 0.1);
  EXPECT_NEAR(a.fit.cut->x_nN.value, b.fit.cut->x_nN.value, 0.2 * a.fit.cut->x_nN.standard_error);
}

TEST(CutCells, places_lie_outside_of_the_image_and_tile_what_is_near_the_cut) {
  const Scene s = scene(41);
  const auto places = tensions::places_beyond(s.cut.cell, 1.5, 1);
  double area_um2 = 0;
  for (const substrate::Ellipse& p : places) {
    const double radius_um = p.semi_major_um;
    EXPECT_LT(p.centre_um.x + 0.5 * std::sqrt(std::numbers::pi) * radius_um, s.window.low_um.x + 1e-9);
    if (s.window.low_um.x - p.centre_um.x < 6 && distance_to_cut_um(s.cut.cell, p.centre_um) < 6)
      area_um2 += std::numbers::pi * radius_um * radius_um;
  }
  double cut_um = 0;
  for (const auto& [a, b] : cuts_of(s.cut.cell)) cut_um += norm(b - a);
  EXPECT_GT(area_um2, 0.8 * 6 * cut_um);
}

TEST(CutCells, motions_of_expected_size_are_a_covariance_of_the_beads) {
  const Scene s = scene(41);
  DisplacementField beads(s.beads.begin(), s.beads.begin() + 40);
  const Eigen::MatrixXd G = Eigen::MatrixXd::Random(80, 6), M = Eigen::MatrixXd::Random(80, 9);
  const Eigen::VectorXd precision = Eigen::VectorXd::LinSpaced(9, 0.3, 1e7);
  const tensions::LinearData data =
      tensions::with_motions(tensions::reduce(beads, G), {.shapes = M, .precision = precision});
  const Eigen::VectorXd weight = tensions::squared_weights(data), forces = Eigen::VectorXd::Random(6);
  Eigen::MatrixXd covariance = M * precision.cwiseInverse().asDiagonal() * M.transpose();
  covariance.diagonal() += weight.cwiseInverse();
  const Eigen::VectorXd left = data.displacement_um - G * forces;
  const double wanted = left.dot(covariance.inverse() * left);
  const double found =
      (tensions::displace(data.reduced, forces) - data.reduced.target).squaredNorm() + data.reduced.floor_squared;
  EXPECT_NEAR(found, wanted, 1e-8 * wanted);
  EXPECT_EQ(data.n_used, 80) << "what is expected costs no component";
}

TEST(CutCells, a_cut_is_a_note_if_allowed_for_and_a_caution_if_not) {
  EXPECT_EQ(properties_of(Symptom::cell_cut).severity, Severity::note);
  stage::EffectSwitches switches;
  const Scene s = scene(41);
  EXPECT_TRUE(tensions::allows_forces_beyond(switches, s.cut.cell));
  EXPECT_FALSE(tensions::allows_forces_beyond(switches, s.experiment.cell));
  switches.beyond_cut = Switch::off;
  EXPECT_FALSE(tensions::allows_forces_beyond(switches, s.cut.cell));
  switches.beyond_cut = Switch::on;
  EXPECT_THROW(tensions::allows_forces_beyond(switches, s.experiment.cell), UsageError);
}

TEST(CutCells, with_fewer_than_two_adhesions_the_cut_still_holds_the_network) {
  const Scene s = scene(41);
  Network network = mesh::generate_network(s.cut.cell, {}).network;
  const int kept = *std::ranges::find_if(network.adhesion_id, [](int id) { return id != 0; });
  for (int& id : network.adhesion_id)
    if (id != kept) id = 0;
  const cables::CableNetwork cables(network);
  EXPECT_EQ(cables.adhesion_ids().size(), 1u);
  network.held_by_cut.clear();
  EXPECT_THROW(cables::CableNetwork{network}, InvalidData);
}

}  // namespace
}  // namespace mbtfm
