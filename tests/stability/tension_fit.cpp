/// Cells and data that make the tension fit hard: the right answer, a wide interval or a clear refusal.
#include "mbtfm/tensions/tension_fit.h"

#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/model_checks.h"
#include "pipeline/contract/errors.h"
#include "tests/support/hard_case.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::fit_own_network;
using test::measure;
using test::tension_scene;
using test::TensionScene;
using test::values_of;

void expect_sound(const EnsembleFit& fit) {
  EXPECT_TRUE(fit.report.converged) << fit.report.reason;
  for (const Estimate& e : fit.tensions.nN) {
    EXPECT_TRUE(std::isfinite(e.value));
    EXPECT_GE(e.value, 0);
    const Interval interval = interval_95(e);
    EXPECT_LE(interval.low, e.value);
    EXPECT_GE(interval.high, e.value);
  }
}

TEST(TensionFitHard, starts_from_1e_6_to_1e3_nN_end_at_the_same_tensions) {
  const TensionScene scene = tension_scene("case_22", 1000, 0.07, 5);
  const TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const Trial first = fit_gauss_newton(problem, {}, uniform_start(problem)).trial;
  const Eigen::MatrixXd covariance = covariance_nN2(local_misfit(first, problem.jacobian(first)), 1);
  double worst = 0;
  for (const double start : {1e-6, 1e-3, 1.0, 1e3}) {
    const Eigen::VectorXd tensions_nN = Eigen::VectorXd::Constant(problem.n_tensions(), start);
    const Trial other = fit_gauss_newton(problem, {}, scaled_to_data(problem, tensions_nN)).trial;
    for (Eigen::Index i = 0; i < first.tensions_nN.size(); ++i) {
      // the fit stops where the last steps tell less than a thirtieth of a standard error; there may be a few
      EXPECT_NEAR(other.tensions_nN[i], first.tensions_nN[i], 0.2 * std::sqrt(covariance(i, i)))
          << "tension " << i << ", started at " << start << " nN";
      worst = std::max(worst, std::abs(other.tensions_nN[i] - first.tensions_nN[i]) / std::sqrt(covariance(i, i)));
    }
  }
  test::came_out("within " + test::two_digits(worst) + " standard errors");
}

TEST(TensionFitHard, beads_all_beside_the_cell_are_refused_with_their_place) {
  const Cell cell = test::round_cell(8, 6);
  DisplacementField beads;
  for (const Adhesion& a : cell.adhesions) beads.push_back({.position_um = a.position_um, .sigma_um = 0.02});
  EXPECT_NO_THROW(check_place(beads, cell));
  EXPECT_NO_THROW(check_place({beads.front()}, cell));  // a field may show a part of the cell
  const auto with_sign = [&](double x, double y) {
    DisplacementField turned = beads;
    for (Bead& bead : turned) bead.position_um = {x * bead.position_um.x, y * bead.position_um.y};
    return turned;
  };
  EXPECT_THROW(check_place(with_sign(-1, 1), cell), InvalidData);
  EXPECT_THROW(check_place(with_sign(1, -1), cell), InvalidData);
}

TEST(TensionFitHard, parallel_fibres_0_2_um_apart_are_named_with_their_sum) {
  Cell cell = test::round_cell(12, 12, {{1, 7}, {3, 9}});
  Fibre beside = cell.fibres[0];  // away from the others, with free ends
  for (Vec2& p : beside.points_um) p = Vec2{30 + 0.4 * (p.x - 30), 36};
  beside.type = FibreType::arc;
  beside.start_adhesion_id = beside.end_adhesion_id = {};
  for (int i = 0; i < 2; ++i) {
    beside.fibre_id = 3 + i;
    cell.fibres.push_back(beside);
    for (Vec2& p : beside.points_um) p.y += 0.2;
  }
  Eigen::VectorXd tensions(5);
  tensions << 0.06, 3, 4, 2, 3;
  TensionScene scene = test::scene_of(cell, tensions, 3000, 0.05, 1);
  const EnsembleFit fit = fit_own_network(scene);
  expect_sound(fit);
  const std::vector<FibreGroup> groups = fibres_not_distinguished(fit);
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].indices, (std::vector<int>{3, 4}));
  EXPECT_LE(std::abs(groups[0].sum_nN.value - 5), 4 * groups[0].sum_nN.noise);
  // the sum is worth reporting: better known than either by what a correlation of −0.95 means, sqrt(2 (1 − 0.95))
  EXPECT_LT(groups[0].sum_nN.noise, 0.35 * fit.tensions.nN[3].noise);
  test::came_out("sum " + test::two_digits(groups[0].sum_nN.value) + " ± " + test::two_digits(groups[0].sum_nN.noise) +
                 " nN, each ± " + test::two_digits(fit.tensions.nN[3].noise) + " nN");
}

TEST(TensionFitHard, a_hundred_fibres) {
  Cell cell = test::round_cell(30, 100);
  Eigen::VectorXd tensions(101);
  tensions[0] = 0.06;
  for (int i = 0; i < 100; ++i) {  // dorsal ones, inwards from each adhesion
    const Vec2 start = cell.adhesions[i].position_um;
    cell.fibres.push_back({.fibre_id = i + 1,
                           .type = FibreType::dorsal,
                           .width_um = 0.6,
                           .start_adhesion_id = i + 1,
                           .mean_intensity = 1,
                           .points_um = {start, Vec2{30, 30} + 0.75 * (start - Vec2{30, 30})}});
    tensions[i + 1] = 0.1 * i;
  }
  TensionScene scene = test::scene_of(cell, tensions, 3000, 0.03, 2);
  const EnsembleFit fit = fit_own_network(scene);
  expect_sound(fit);
  double sum = 0;
  int n = 0;
  for (std::size_t i = 0; i < fit.tensions.nN.size(); ++i) {
    const Estimate& e = fit.tensions.nN[i];
    if (e.value <= 2 * e.noise) continue;  // those at the bound are better than their noise
    sum += std::pow((e.value - tensions[static_cast<Eigen::Index>(i)]) / e.noise, 2);
    ++n;
  }
  ASSERT_GT(n, 30);
  // Mean square of errors in standard errors: 1 ± sqrt(2/n), correlated, so twice that; three of those.
  EXPECT_LT(sum / n, 1 + 6 * std::sqrt(2.0 / n));
  test::came_out("mean squared error over stated variance " + test::two_digits(sum / n));
}

TEST(TensionFitHard, fewer_beads_than_unknowns_are_refused_with_the_count_that_would_do) {
  TensionScene scene = tension_scene("case_21", 4, 0.05, 3);
  const InvalidData error = test::thrown<InvalidData>([&] { fit_own_network(scene); });
  const std::string enough = "at least " + std::to_string((scene.tensions_nN.size() + 1) / 2) + " good beads";
  EXPECT_TRUE(has_words(error.what(), enough));
  test::came_out(error.what());
}

TEST(TensionFitHard, a_fibre_without_beads_near_it_gets_a_wide_interval_that_covers) {
  TensionScene scene = tension_scene("case_21", 3000, 0.05, 4);
  const EnsembleFit everywhere = fit_own_network(scene);
  double middle_um = 0;  // beads are kept on one side only
  for (const Vec2 p : scene.points_um) middle_um += p.x / static_cast<double>(scene.points_um.size());
  std::vector<bool> is_used;
  for (const Vec2 p : scene.points_um) is_used.push_back(p.x < middle_um - 5);
  scene.data = reduce(scene.beads, scene.compliance_um_per_nN, is_used);
  const EnsembleFit fit = fit_own_network(scene);
  expect_sound(fit);
  double widest = 0;
  for (std::size_t i = 1; i < fit.tensions.nN.size(); ++i) {
    const double before = everywhere.tensions.nN[i].noise;  // none where the tension is held at zero
    if (before > 0) widest = std::max(widest, fit.tensions.nN[i].noise / before);
    const Interval interval = interval_95(fit.tensions.nN[i]);
    const double sigmas = 2 * fit.tensions.nN[i].noise;  // beyond the interval: four standard errors
    EXPECT_LE(interval.low - sigmas, scene.tensions_nN[static_cast<Eigen::Index>(i)]);
    EXPECT_GE(interval.high + sigmas, scene.tensions_nN[static_cast<Eigen::Index>(i)]);
  }
  EXPECT_GT(widest, 2);
  test::came_out("up to " + test::two_digits(widest) + " times as wide");
}

TEST(TensionFitHard, where_nothing_pulls_no_tension_is_found) {
  TensionScene scene = tension_scene("case_21", 1000, 0.05, 5);
  const double sigma_um = 0.02;
  test::Normal normal(6);
  for (Bead& bead : scene.beads) {
    bead.displacement_um = {sigma_um * normal(), sigma_um * normal()};
    bead.sigma_um = sigma_um;
  }
  scene.data = reduce(scene.beads, scene.compliance_um_per_nN);
  const EnsembleFit fit = fit_own_network(scene);
  expect_sound(fit);
  int n_covering = 0;
  for (const Estimate& e : fit.tensions.nN) n_covering += interval_95(e).low <= 1e-9 ? 1 : 0;
  // 95 % intervals, at the bound 97.5 %: of a dozen one may miss
  EXPECT_GE(n_covering, static_cast<int>(fit.tensions.nN.size()) - 1);
  test::came_out(std::to_string(n_covering) + " of " + std::to_string(fit.tensions.nN.size()));
}

TEST(TensionFitHard, one_adhesion_that_carries_everything) {
  Cell cell = test::round_cell(15, 16);
  for (const int end : {6, 7, 8, 9, 10, 11, 12}) test::add_ventral(cell, 1, end);
  Eigen::VectorXd tensions(8);
  tensions << 0.001, 5, 6, 7, 8, 7, 6, 5;
  TensionScene scene = test::scene_of(cell, tensions, 3000, 0, 7);
  const EnsembleFit exact = fit_own_network(scene);
  expect_sound(exact);
  // noise-free; the fibres meet at a small angle, which costs digits
  const double worst_nN = (values_of(exact) - tensions).tail(7).cwiseAbs().maxCoeff();
  EXPECT_LE(worst_nN, 1e-5 * 8);
  test::came_out("noise-free within " + test::two_digits(worst_nN) + " nN of 5 to 8 nN");
  measure(scene, 0.1, 8);
  expect_sound(fit_own_network(scene));
}

TEST(TensionFitHard, noise_as_large_as_the_signal_widens_the_intervals) {
  TensionScene scene = tension_scene("case_22", 2000, 0.05, 9);
  const EnsembleFit little = fit_own_network(scene);
  measure(scene, 1.0, 10);
  const EnsembleFit much = fit_own_network(scene);
  expect_sound(much);
  int n_covering = 0;
  for (std::size_t i = 0; i < much.tensions.nN.size(); ++i) {
    const Interval wide = interval_95(much.tensions.nN[i]), narrow = interval_95(little.tensions.nN[i]);
    EXPECT_GT(wide.high - wide.low, narrow.high - narrow.low) << "tension " << i;
    const double truth = scene.tensions_nN[static_cast<Eigen::Index>(i)];
    n_covering += wide.low <= truth && truth <= wide.high ? 1 : 0;
  }
  // binomial, 0.95 of a dozen or more: 80 % is four standard deviations below
  EXPECT_GE(n_covering, static_cast<int>(0.8 * static_cast<double>(much.tensions.nN.size())));
  test::came_out(std::to_string(n_covering) + " of " + std::to_string(much.tensions.nN.size()) + " cover");
}

}  // namespace
}  // namespace mbtfm::tensions
