#include "mbtfm/tensions/tension_fit.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/robust.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::tension_scene;
using test::TensionScene;

TensionFit fit(const TensionScene& scene, const FitParameters& parameters) {
  const TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  return fit_tensions(problem, parameters, 2, uniform_start(problem));
}

double relative_error(const TensionFit& fit, const TensionScene& scene) {
  return (fit.trial.tensions_nN - scene.tensions_nN).norm() / scene.tensions_nN.norm();
}

TEST(TensionFit, noise_free_tensions_on_the_same_network_come_back) {
  for (const char* name : {"case_21", "case_22"}) {
    const TensionScene scene = tension_scene(name, 2000, 0, 1);
    const TensionFit result = fit(scene, {});
    EXPECT_TRUE(result.report.converged) << result.report.reason;
    EXPECT_LE(result.report.iterations, 15) << name;
    // The equilibrium is solved to 1e-9 of the largest tension; the fit is well conditioned.
    EXPECT_LE((result.trial.tensions_nN - scene.tensions_nN).cwiseAbs().cwiseQuotient(scene.tensions_nN).maxCoeff(),
              1e-7)
        << name;
  }
}

TEST(TensionFit, reduced_data_give_the_misfit_of_all_beads) {
  const TensionScene scene = tension_scene("case_21", 500, 0.07, 2);
  const Eigen::VectorXd forces = 0.8 * scene.forces_nN;
  const Eigen::VectorXd all =
      scene.data.weight_per_um.cwiseProduct(scene.data.response->displace(forces) - scene.data.displacement_um);
  const double reduced = (*scene.data.reduced.compliance * forces - scene.data.reduced.target).squaredNorm() +
                         scene.data.reduced.floor_squared;
  EXPECT_NEAR(reduced, all.squaredNorm(), 1e-9 * all.squaredNorm());
}

TEST(TensionFit, the_exact_gradient_agrees_with_finite_differences) {
  const TensionScene scene = tension_scene("case_22", 500, 0.07, 3);
  const TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const Trial trial = problem.evaluate(0.7 * scene.tensions_nN);
  const Eigen::VectorXd exact = problem.gradient(trial);
  const Eigen::VectorXd differences = problem.finite_difference_gradient(trial, 2);
  // Central differences at 1e-5 of the largest tension: equilibria good to 1e-9 leave 1e-3 of a small component.
  EXPECT_LE((exact - differences).norm(), 1e-3 * exact.norm());
}

TEST(TensionFit, finite_differences_see_a_slack_fibre_begin_to_pull) {
  const TensionScene scene = tension_scene("case_21", 1000, 0, 4);
  const TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  Eigen::VectorXd tensions = scene.tensions_nN;
  Eigen::Index strongest = 0;
  tensions.maxCoeff(&strongest);
  tensions[strongest] = 0;
  const Trial trial = problem.evaluate(tensions);
  const double exact = problem.gradient(trial)[strongest];
  ASSERT_LT(exact, 0) << "the beads want it to pull";
  // A zero tension stands for 1e-7 of the largest, a hundredth of the step.
  EXPECT_NEAR(problem.finite_difference_gradient(trial, 2)[strongest], exact, 0.05 * std::abs(exact));
}

TEST(TensionFit, blockwise_conjugate_gradients_find_the_noise_free_tensions) {
  const TensionScene scene = tension_scene("case_21", 1000, 0, 4);
  FitParameters parameters{.max_evaluations = 1500};
  parameters.method = FitMethod::blockwise_cg;
  // The thesis' stopping rule leaves more than this (fig. 3.4); conjugate gradients with exact gradients get here in
  // some hundred evaluations.
  EXPECT_LE(relative_error(fit(scene, parameters), scene), 1e-3);
}

TEST(TensionFit, all_methods_end_at_the_same_minimum_and_Gauss_Newton_is_there_first) {
  const TensionScene scene = tension_scene("case_21", 1000, 0.05, 5);
  const TensionFit newton = fit(scene, {});
  for (const FitMethod method : {FitMethod::plain_cg, FitMethod::blockwise_cg}) {
    const TensionFit other = fit(scene, {.method = method, .max_evaluations = 1500});
    // a hundredth of a bead's variance: a tenth of a standard error
    EXPECT_NEAR(other.trial.objective, newton.trial.objective, 0.01) << name_of(method);
    EXPECT_LT(5 * newton.n_evaluations, other.n_evaluations) << name_of(method);
  }
}

TEST(TensionFit, gradients_by_finite_differences_are_the_same_for_any_threads) {
  const TensionScene scene = tension_scene("case_21", 500, 0.07, 6);
  const TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const Trial trial = problem.evaluate(0.7 * scene.tensions_nN);
  EXPECT_TRUE(problem.finite_difference_gradient(trial, 1) == problem.finite_difference_gradient(trial, 4));
}

TEST(TensionFit, displacements_solved_for_each_trial_give_the_same_objective) {
  const TensionScene scene = tension_scene("case_21", 500, 0.07, 7);
  const auto solved = [&](const Eigen::VectorXd& forces) {
    return weighted_residual(scene.data, forces).squaredNorm();
  };
  const TensionProblem fast(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const TensionProblem slow(scene.cables, scene.data.reduced, scene.adhesion_ids, solved);
  const Eigen::VectorXd tensions = 0.8 * scene.tensions_nN;
  const double objective = fast.evaluate(tensions).objective;
  // rounding of the whole misfit, of which the objective is the part that tensions can change
  EXPECT_NEAR(slow.evaluate(tensions).objective, objective, 1e-12 * (objective + scene.data.reduced.floor_squared));
}

TEST(TensionFit, beads_outside_the_region_do_not_count) {
  TensionScene scene = tension_scene("case_21", 1000, 0.05, 8);
  std::vector<bool> is_used(scene.beads.size(), true);
  for (std::size_t i = 0; i < is_used.size(); i += 3) {
    is_used[i] = false;
    scene.beads[i].displacement_um = {100, -100};
  }
  scene.data = reduce(scene.beads, scene.compliance_um_per_nN, is_used);
  EXPECT_EQ(scene.data.n_used, 2 * (1000 - 334));
  const EnsembleFit result = test::fit_own_network(scene);
  // 0.05 of noise, a hundred beads a tension
  EXPECT_LE((test::values_of(result) - scene.tensions_nN).norm(), 0.2 * scene.tensions_nN.norm());
  EXPECT_LE(relative_l2(result.data, result.forces.nN), 1);
}

TEST(Intervals, errors_make_the_sum_of_magnitudes_as_much_too_large_as_they_do_on_average) {
  // Three forces that answer to four tensions of a known covariance; errors of some per cent, each draw and its
  // opposite, so that only what is even in them is left.
  test::Normal normal(6);
  const auto drawn = [&](int rows, int columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(); }).eval();
  };
  const Eigen::VectorXd forces = 10 * drawn(6, 1);
  const Eigen::MatrixXd D = drawn(6, 4), root = 0.2 * drawn(4, 4);
  constexpr int kDraws = 20000;
  double sum = 0, squares = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd change = D * (root * drawn(4, 1));
    const double more = 0.5 * (total_nN(forces + change) + total_nN(forces - change)) - total_nN(forces);
    sum += more / kDraws;
    squares += more * more / kDraws;
  }
  const double standard_error = std::sqrt((squares - sum * sum) / kDraws);
  // to second order in errors of a tenth: a hundredth
  EXPECT_NEAR(magnitude_bias_nN(forces, D, root * root.transpose()), sum, 4 * standard_error + 0.02 * sum);
}

TEST(Intervals, by_percentiles_leave_one_draw_in_forty_out_on_either_side) {
  std::mt19937_64 random(8);
  std::exponential_distribution<double> skewed;
  std::vector<double> deviations;
  for (int i = 0; i < 4001; ++i) deviations.push_back(skewed(random) - 1);
  const Sides sides = percentiles_95(deviations);
  const auto share = [&](const auto& is_out) {
    return static_cast<double>(std::count_if(deviations.begin(), deviations.end(), is_out)) / 4001;
  };
  EXPECT_NEAR(share([&](double d) { return d < -sides.below; }), 0.025, 2.0 / 4001);
  EXPECT_NEAR(share([&](double d) { return d > sides.above; }), 0.025, 2.0 / 4001);
}

TEST(Intervals, of_few_degrees_of_freedom_are_Students_on_either_side) {
  constexpr double kStudent = 3.182446, kNormal = 1.959964;  // 97.5 % of 3 degrees and of many, from tables
  const Interval even = interval_95({.value = 10, .standard_error = 1, .degrees = 3});
  EXPECT_NEAR(even.low, 10 - kStudent, 1e-5);
  EXPECT_NEAR(even.high, 10 + kStudent, 1e-5);
  const Interval uneven = interval_95({.value = 10, .standard_error = 1, .degrees = 3, .sides_95 = Sides{2, 4}});
  EXPECT_NEAR(uneven.low, 10 - 2 * kStudent / kNormal, 1e-5);
  EXPECT_NEAR(uneven.high, 10 + 4 * kStudent / kNormal, 1e-5);
}

TEST(NoiseVariance, of_few_beads_counts_what_independent_forces_follow) {
  // 24 components, of which 8 forces take 8; over draws of noise alone the mean is the noise's
  constexpr int kBeads = 12, kForces = 8, kDraws = 2000;
  test::Normal normal(11);
  const Eigen::MatrixXd G = Eigen::MatrixXd::NullaryExpr(2 * kBeads, kForces, [&] { return normal(); });
  double mean = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    DisplacementField beads(kBeads);
    for (Bead& b : beads) {
      const double x = normal();
      b.displacement_um = {0.2 * x, 0.2 * normal()};
    }
    mean += noise_variance(reduce(beads, G)) / kDraws;
  }
  EXPECT_NEAR(mean / 0.04, 1, 4 * std::sqrt(2.0 / (2 * kBeads - kForces) / kDraws));
}

TEST(NoiseLevel, is_the_standard_deviation_of_a_component_far_from_the_cell_whatever_outliers_do) {
  // A cell of 20 um; beads far from it have noise of 0.05 um, one in ten of them goes astray, and those near it are
  // moved by what no force explains.
  constexpr double kSigma_um = 0.05;
  const Polygon outline = {{-10, -10}, {10, -10}, {10, 10}, {-10, 10}};
  test::Normal noise(4, kSigma_um);
  const auto of = [&](int n_far, double astray) {
    DisplacementField beads;
    for (int i = 0; i < n_far + 4000; ++i) {
      const double angle = 0.01 * i, radius = i < n_far ? 40 : 5;
      const double x = noise(), y = noise();
      beads.push_back({.position_um = radius * Vec2{std::cos(angle), std::sin(angle)},
                       .displacement_um = {x + (i < n_far && i % 10 == 0 ? astray : 0), y + (i < n_far ? 0 : 1)}});
    }
    const LinearData data = reduce(beads, Eigen::MatrixXd::Zero(2 * static_cast<Eigen::Index>(beads.size()), 2));
    return noise_level(data, Eigen::VectorXd::Zero(2), outline, 10).sigma_um;
  };
  // The median of n magnitudes tells a standard deviation to 1.17 / sqrt(n); four of those.
  EXPECT_NEAR(of(10000, 0), kSigma_um, 4 * 1.17 / std::sqrt(20000.0) * kSigma_um);
  // one component in twenty beyond all others moves the median by as much as 0.05 / 2 of the distribution: 6 %
  EXPECT_NEAR(of(10000, 10), kSigma_um, 0.08 * kSigma_um);
  EXPECT_GT(of(20, 0), 2 * kSigma_um);  // too few are far: all count
}

/// Variance of least squares over that of this loss, of many beads whose residuals are Gaussian in the plane:
/// <(psi' + psi/r)/2>² / <psi²/2> over Rayleigh's distribution of their lengths, where by parts the slope is <psi r/2>.
double efficiency(Loss loss) {
  constexpr double kStep = 1e-3;
  double slope = 0, psi_squared = 0;
  for (double r = kStep / 2; r < 10; r += kStep) {
    const double share = kStep * r * std::exp(-0.5 * r * r), psi = r * inverse::weight(loss, r, 2);
    slope += share * psi * r / 2;
    psi_squared += share * psi * psi / 2;
  }
  return slope * slope / psi_squared;
}

TEST(RobustLoss, costs_the_efficiency_it_says_where_the_noise_is_Gaussian_in_the_plane) {
  EXPECT_NEAR(efficiency(Loss::squares), 1, 1e-6);
  EXPECT_NEAR(efficiency(Loss::huber), 0.95, 5e-4);  // what is stated, to its last digit
  EXPECT_NEAR(efficiency(Loss::tukey), 0.95, 5e-4);
  EXPECT_NEAR(efficiency(Loss::l1), std::numbers::pi / 4, 5e-4);
}

TEST(RobustLoss, lets_one_bead_pull_no_harder_than_a_bound) {
  // w r: rises no more beyond huber's bound, and comes back to zero for tukey
  for (const double r : {2.0, 10.0, 1e6}) {
    EXPECT_NEAR(r * inverse::weight(Loss::huber, r, 2), 100 * inverse::weight(Loss::huber, 100, 2), 1e-9);
    EXPECT_NEAR(r * inverse::weight(Loss::l1, r, 2), 1, 1e-9);
  }
  EXPECT_EQ(inverse::weight(Loss::tukey, 10, 2), 0);
}

TEST(RobustLoss, states_the_variance_that_its_efficiency_leaves) {
  // Beads that nothing pulls: the covariance is this over the sum of the weights, and over that of least squares it is
  // one over the efficiency. The scale by the median is known to 1/sqrt(n) (Rayleigh), its square to twice that.
  constexpr Eigen::Index kBeads = 40000;
  test::Normal normal(3, 0.2);
  LinearData data;
  data.weight_per_um = Eigen::VectorXd::Ones(2 * kBeads);
  data.displacement_um.resize(2 * kBeads);
  for (double& u : data.displacement_um) u = normal();
  data.response = substrate::dense_response(Eigen::MatrixXd::Zero(2 * kBeads, 2));
  data.n_used = 2 * kBeads;
  const Eigen::VectorXd no_forces = Eigen::VectorXd::Zero(2);
  for (const Loss loss : {Loss::squares, Loss::huber, Loss::tukey}) {
    double weights = 0;
    for (Eigen::Index b = 0; b < kBeads; ++b)
      weights += inverse::weight(loss, data.displacement_um.segment<2>(2 * b).norm() / 0.2, 2) / kBeads;
    const double variance = misfit_variance(data, no_forces, 1, loss) / weights;
    EXPECT_NEAR(variance * efficiency(loss) / 0.04, 1, 4 * 2 / std::sqrt(1.0 * kBeads)) << name_of(loss);
  }
}

TEST(BoundedQuadratic, its_minimum_fulfils_the_conditions_of_Karush_Kuhn_and_Tucker) {
  std::srand(7);
  for (int seed = 0; seed < 200; ++seed) {
    const int n = 1 + seed % 12;
    const Eigen::MatrixXd root = Eigen::MatrixXd::Random(n, n);
    const Eigen::MatrixXd H = root.transpose() * root + 1e-3 * Eigen::MatrixXd::Identity(n, n);
    const Eigen::VectorXd g = Eigen::VectorXd::Random(n);
    const Eigen::VectorXd low = -Eigen::VectorXd::Random(n).cwiseAbs();
    const Eigen::VectorXd x = bounded_quadratic_minimum(H, g, low);
    const Eigen::VectorXd gradient = H * x + g;
    for (int i = 0; i < n; ++i) {
      EXPECT_GE(x[i], low[i]) << "seed " << seed;
      // rounding of H x, for a condition of about 1e4
      if (x[i] > low[i])
        EXPECT_NEAR(gradient[i], 0, 1e-9) << "seed " << seed;
      else
        EXPECT_GE(gradient[i], -1e-9) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace mbtfm::tensions
