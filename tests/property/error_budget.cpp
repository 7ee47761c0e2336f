
#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/second_placement.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

constexpr SegmentationErrors kExact{0, 0, 0, 0};

// Of the displacement: the budget is linear about the fit, which is compared with answers about the truth.
constexpr double kLittleNoise = 0.005;

/// The scene's adhesions, one at each held vertex.
Cell cell_of(const TensionScene& scene) {
  Cell cell;
  for (std::size_t i = 0; i < scene.ellipses.size(); ++i) {
    const substrate::Ellipse& e = scene.ellipses[i];
    cell.adhesions.push_back({.adhesion_id = scene.adhesion_ids[i],
                              .position_um = e.centre_um,
                              .area_um2 = std::numbers::pi * e.semi_major_um * e.semi_minor_um,
                              .major_axis_um = 2 * e.semi_major_um,
                              .minor_axis_um = 2 * e.semi_minor_um,
                              .angle_rad = e.angle_rad});
  }
  return cell;
}

struct Fitted {
  TensionScene scene;
  std::vector<cables::CableNetwork> networks;
  EnsembleFit fit;
  ErrorBudget budget(SegmentationErrors errors, double substrate_error = 0, bool lacks_base = false,
                     const Gel& gel = test::kGel) const {
    const Cell cell = cell_of(scene);
    return error_budget({fit, fit.data, networks, cell, gel, substrate_error, lacks_base, errors}, 2);
  }
};

Fitted fitted(TensionScene scene) {
  Fitted f{std::move(scene), {}, {}};
  f.networks.emplace_back(f.scene.cables.network());
  f.fit = test::fit_own_network(f.scene);
  return f;
}

/// The fit's answers, in truth, to a change of the displacements.
Eigen::VectorXd answers(const Fitted& f, const Eigen::VectorXd& displacement_um) {
  DisplacementField beads = f.scene.beads;
  for (std::size_t b = 0; b < beads.size(); ++b)
    beads[b].displacement_um = {displacement_um[2 * b], displacement_um[2 * b + 1]};
  const EnsembleFit fit =  // the propagation is that of squares
      test::fit_to(reduce(beads, f.scene.compliance_um_per_nN), f.scene, {.loss = Loss::squares});
  return test::values_of(fit) - f.scene.tensions_nN;
}

TEST(ErrorBudget, without_further_errors_its_parts_are_those_of_the_intervals) {
  Cell cell = test::round_cell(14, 16, {{1, 9}, {3, 12}, {5, 15}});
  Fitted f{test::scene_of(cell, Eigen::Vector4d(0.1, 3, 5, 2), 1500, 0.05, 7), {}, {}};
  for (std::uint64_t seed = 11; seed < 15; ++seed)
    f.networks.emplace_back(mesh::generate_network(cell, {.seed = seed}).network);
  const EnsembleFit& fit = f.fit = fit_ensemble(f.networks, f.scene.data, f.scene.adhesion_ids, {}, 2);
  const ErrorBudget budget = f.budget(kExact);
  for (std::size_t i = 0; i < fit.tensions.nN.size(); ++i) {
    const ErrorParts& parts = budget.tensions[i].parts_nN;
    EXPECT_NEAR(parts.beads, fit.tensions.nN[i].noise, 1e-9 * parts.beads) << i;
    ASSERT_TRUE(parts.mesh);
    const double stated = fit.tensions.nN[i].standard_error;
    EXPECT_NEAR(std::hypot(parts.beads, *parts.mesh, parts.model), stated, 1e-6 * stated) << i;
    EXPECT_EQ(parts.segmentation, 0);
    EXPECT_EQ(parts.substrate, 0);
    EXPECT_LT(parts.solver, 0.2 * parts.beads);  // the fit stops where no bead could tell the difference
  }
  EXPECT_NEAR(budget.total_force_nN, total_nN(adhesion_forces_nN(fit)), 1e-9);
}

TEST(ErrorBudget, one_mesh_shows_nothing_of_the_mesh) {
  const Fitted f = fitted(test::tension_scene("case_21", 600, 0.05, 3));
  EXPECT_FALSE(f.budget(kExact).tensions.front().parts_nN.mesh);
}

/// Cells whose adhesions lie elsewhere than the segmentation has them, fitted without bead noise.
TEST(ErrorBudget, states_what_errors_of_the_segmentation_do) {
  const Fitted f = fitted(test::tension_scene("case_21", 2500, kLittleNoise, 3));
  const SegmentationErrors errors{0.05, 0.2, 8, 0};
  const ErrorBudget budget = f.budget(errors);
  constexpr int kDraws = 24;
  test::Normal normal(5);
  const std::size_t n = budget.tensions.size();
  std::vector<double> squares(n, 0.0);
  for (int draw = 0; draw < kDraws; ++draw) {
    TensionScene truth = test::tension_scene("case_21", 2500, kLittleNoise, 3);
    Network network = truth.cables.network();
    for (std::size_t a = 0; a < truth.ellipses.size(); ++a) {
      substrate::Ellipse& e = truth.ellipses[a];
      const Vec2 shift{errors.adhesion_shift_error_um * normal(), errors.adhesion_shift_error_um * normal()};
      const double growth = 1 + errors.adhesion_area_error / 2 * normal();
      e.centre_um += shift;
      e.semi_major_um *= growth;
      e.semi_minor_um *= growth;
      e.angle_rad += errors.adhesion_angle_error_deg * std::numbers::pi / 180 * normal();
      network.vertices_um[static_cast<std::size_t>(truth.adhesion_ids[a]) - 1] += shift;
    }
    const Network& old = f.scene.cables.network();
    for (Link& link : network.links) {
      const auto length = [&](const Network& of) {
        return norm(of.vertices_um[link.vertex_b] - of.vertices_um[link.vertex_a]);
      };
      link.rest_length_um *= length(network) / length(old);
    }
    truth.cables = cables::CableNetwork(network);
    truth.compliance_um_per_nN = greens::make_greens(test::kGel, {.model = substrate::ModelKind::layer}, 2)
                                     ->compliance_um_per_nN(truth.points_um, truth.ellipses);
    test::contract(truth, f.scene.tensions_nN);
    const Eigen::VectorXd error = answers(f, truth.displacement_um);
    for (std::size_t i = 0; i < n; ++i) squares[i] += std::pow(error[static_cast<Eigen::Index>(i)], 2) / kDraws;
  }
  double observed = 0, stated = 0, log_ratio = 0;
  int n_compared = 0;
  for (std::size_t i = 1; i < n; ++i) {
    // the bound t >= 0 cuts off larger errors
    if (f.scene.tensions_nN[static_cast<Eigen::Index>(i)] < 3 * budget.tensions[i].parts_nN.segmentation) continue;
    ++n_compared;
    observed += squares[i];
    stated += std::pow(budget.tensions[i].parts_nN.segmentation, 2);
    log_ratio += 0.5 * std::log(squares[i] / std::pow(budget.tensions[i].parts_nN.segmentation, 2));
  }
  // each tension's mean square of 24 draws is known to 29 %, their sum and the mean of the logarithms to some 10 %
  EXPECT_NEAR(std::sqrt(observed / stated), 1, 0.25);
  ASSERT_GE(n_compared, 7);
  EXPECT_NEAR(log_ratio / n_compared, 0, 0.25);
}

TEST(ErrorBudget, gives_the_bias_of_a_substrate_that_lacks_the_base) {
  TensionScene scene = test::tension_scene("case_21", 1500, kLittleNoise, 3);
  const Eigen::VectorXd on_layer = scene.displacement_um;
  scene.compliance_um_per_nN = greens::make_greens(test::kGel, {.model = substrate::ModelKind::half_space}, 2)
                                   ->compliance_um_per_nN(scene.points_um, scene.ellipses);
  test::contract(scene, scene.tensions_nN);
  test::measure(scene, kLittleNoise, 3);
  const Fitted f = fitted(std::move(scene));
  const Eigen::VectorXd bias = answers(f, on_layer);
  const ErrorBudget budget = f.budget(kExact, 0, true);
  double difference = 0;
  for (Eigen::Index i = 1; i < bias.size(); ++i)
    difference += std::pow(std::abs(bias[i]) - budget.tensions[i].parts_nN.substrate, 2);
  // to first order: the network's answer to tensions bends by some per cent over a bias of this size
  EXPECT_LT(std::sqrt(difference), 0.1 * bias.tail(bias.size() - 1).norm());
}

/// A fit that is stopped early is off by what was left to go. (Near a bound the part is larger than that: it takes the
/// whole step, which the bound would have cut.)
TEST(ErrorBudget, shows_what_a_fit_that_stops_early_leaves_undone) {
  Cell cell = test::round_cell(14, 16, {{1, 9}, {3, 12}, {5, 15}});
  const auto scene = [&] { return test::scene_of(cell, Eigen::Vector4d(0.1, 3, 5, 2), 1500, 0.02, 7); };
  TensionScene whole = scene();
  const Eigen::VectorXd end = test::values_of(test::fit_own_network(whole, {.loss = Loss::squares}));
  int n_compared = 0;
  for (int steps = 1; steps < 6; ++steps) {
    Fitted early{scene(), {}, {}};
    early.networks.emplace_back(early.scene.cables.network());
    early.fit = test::fit_own_network(early.scene, {.loss = Loss::squares, .max_steps = steps});
    const Eigen::VectorXd left = test::values_of(early.fit) - end;
    // further off the misfit bends, and nearer the whole fit's own last step counts
    if (left.norm() > 0.1 * end.norm() || left.norm() < 1e-4 * end.norm()) continue;
    const ErrorBudget budget = early.budget(kExact);
    double stated = 0;
    for (const auto& tension : budget.tensions) stated += std::pow(tension.parts_nN.solver, 2);
    // to first order: the forces' answer to tensions bends by some per cent over so short a step
    EXPECT_NEAR(std::sqrt(stated) / left.norm(), 1, 0.2) << "after " << steps << " steps";
    ++n_compared;
  }
  EXPECT_GE(n_compared, 1);
}

TEST(ErrorBudget, ten_percent_of_the_modulus_are_ten_percent_of_every_tension_and_of_the_force) {
  const Fitted f = fitted(test::tension_scene("case_21", 800, kLittleNoise, 5));
  Gel gel = test::kGel;
  gel.youngs_modulus_sigma_kPa = 0.1 * gel.youngs_modulus_kPa;
  const ErrorBudget budget = f.budget(kExact, 0, false, gel);
  for (const TensionError& t : budget.tensions) {
    ASSERT_TRUE(t.parts_nN.gel);
    EXPECT_NEAR(*t.parts_nN.gel, 0.1 * t.tension_nN, 1e-9);
  }
  // forces grow with the tensions but for cables beyond their rest length, whose stretch is the same
  EXPECT_NEAR(*budget.total_force_parts_nN.gel, 0.1 * budget.total_force_nN, 0.02 * budget.total_force_nN);
  EXPECT_FALSE(f.budget(kExact).tensions.front().parts_nN.gel);
}

TEST(ErrorBudget, an_error_of_the_thickness_or_of_poissons_ratio_does_what_another_gel_would_do_to_the_fit) {
  const Fitted f = fitted(test::tension_scene("case_21", 800, kLittleNoise, 5));
  Gel thicker = test::kGel, less_tight = test::kGel;
  thicker.thickness_sigma_um = 2;  // little: the propagation is linear
  less_tight.poisson_ratio_sigma = 0.01;
  for (Gel gel : {thicker, less_tight}) {
    const ErrorBudget budget = f.budget(kExact, 0, false, gel);
    Gel other = gel;
    other.thickness_um += gel.thickness_sigma_um.value_or(0);
    other.poisson_ratio -= gel.poisson_ratio_sigma.value_or(0);
    const Eigen::VectorXd change = greens::make_greens(other, {.model = substrate::ModelKind::layer}, 2)
                                       ->compliance_um_per_nN(f.scene.points_um, f.scene.ellipses) *
                                   f.scene.forces_nN;
    const Eigen::VectorXd moved = answers(f, change);
    for (std::size_t i = 0; i < budget.tensions.size(); ++i) {
      const double stated = *budget.tensions[i].parts_nN.gel;
      EXPECT_NEAR(stated, std::abs(moved[static_cast<Eigen::Index>(i)]), 0.1 * stated + 0.01) << i;
    }
  }
}

TEST(ErrorBudget, of_a_tension_at_zero_is_what_its_interval_says) {
  TensionScene scene = test::tension_scene("case_21", 800, 0.05, 5);
  Eigen::VectorXd tensions = scene.tensions_nN;
  tensions[1] = 1;
  test::contract(scene, tensions);
  const Eigen::VectorXd pulling_um = scene.displacement_um;
  tensions[1] = 0;
  test::contract(scene, tensions);
  scene.displacement_um += 4 * (scene.displacement_um - pulling_um);  // as if the fibre pushed
  test::measure(scene, 0.05, 3);
  const Fitted f = fitted(std::move(scene));
  ASSERT_EQ(f.fit.tensions.nN[1].value, 0);
  ASSERT_EQ(f.fit.tensions.nN[1].noise, 0);  // it is held
  const ErrorParts parts = f.budget(kExact).tensions[1].parts_nN;
  EXPECT_GT(parts.beads, 0);
  EXPECT_NEAR(std::hypot(parts.beads, parts.model), f.fit.tensions.nN[1].sides_95->above / kNormal95, 1e-9);
}

EnsembleFit answer_of(std::vector<int> ids, const std::vector<double>& tensions_nN, double total_nN) {
  EnsembleFit fit;
  fit.tensions.fibre_ids = std::move(ids);
  for (const double t : tensions_nN) fit.tensions.nN.push_back({.value = t});
  fit.total_force_nN.value = total_nN;
  return fit;
}

TEST(ErrorBudget, two_placements_of_the_candidates_show_the_error_of_placing_them) {
  // Of answers with the variance v, half the squared difference of two has the mean v.
  const PlacementSpread spread =
      spread_between(answer_of({0, 1, 2, 4}, {0.1, 5, 3, 2}, 100), answer_of({0, 1, 4}, {0.1, 8, 2}, 110));
  EXPECT_NEAR(spread.tensions_nN.at(1), 3 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(spread.tensions_nN.at(0), 0, 1e-12);
  EXPECT_NEAR(spread.tensions_nN.at(4), 0, 1e-12);
  EXPECT_FALSE(spread.tensions_nN.contains(2));  // too short where the other candidates hold it
  EXPECT_NEAR(spread.total_force_nN, 10 / std::sqrt(2.0), 1e-12);
  ErrorBudget budget;
  for (const int id : {0, 1, 2, 4})
    budget.tensions.push_back({.fibre_id = id, .tension_nN = 1, .parts_nN = {.segmentation = 0.5}});
  budget.total_force_parts_nN.segmentation = 1;
  const ErrorBudget whole = with_spread(budget, spread);
  EXPECT_NEAR(whole.tensions[1].parts_nN.segmentation, std::hypot(0.5, 3 / std::sqrt(2.0)), 1e-12);
  EXPECT_EQ(whole.tensions[2].parts_nN.segmentation, 0.5);
  EXPECT_NEAR(whole.total_force_parts_nN.segmentation, std::hypot(1, 10 / std::sqrt(2.0)), 1e-12);
}

}  // namespace
}  // namespace mbtfm::tensions
