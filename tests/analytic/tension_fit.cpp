#include "mbtfm/tension_fit.h"

#include <gtest/gtest.h>

#include "mbtfm/ensemble.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::inverse {
namespace {

using test::tension_scene;
using test::TensionScene;

TensionFit fit(const TensionScene& scene, const FitParameters& parameters) {
  const TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  return fit_tensions(problem, parameters, 2, uniform_start_nN(problem));
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
      scene.data.weight_per_um.cwiseProduct(scene.data.compliance_um_per_nN * forces - scene.data.displacement_um);
  const double reduced = (scene.data.reduced.compliance * forces - scene.data.reduced.target).squaredNorm() +
                         scene.data.reduced.floor_squared;
  EXPECT_NEAR(reduced, all.squaredNorm(), 1e-9 * all.squaredNorm());
}

TEST(TensionFit, the_exact_gradient_agrees_with_finite_differences) {
  const TensionScene scene = tension_scene("case_22", 500, 0.07, 3);
  const TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const Trial trial = problem.evaluate(0.7 * scene.tensions_nN);
  const Eigen::VectorXd exact = problem.gradient(trial);
  const Eigen::VectorXd differences = problem.finite_difference_gradient(trial, 2);
  // Central differences at 1e-6 of a tension: equilibria good to 1e-9 leave 1e-3 of a small component.
  EXPECT_LE((exact - differences).norm(), 1e-3 * exact.norm());
}

TEST(TensionFit, blockwise_conjugate_gradients_find_the_noise_free_tensions) {
  const TensionScene scene = tension_scene("case_21", 1000, 0, 4);
  FitParameters parameters{.max_evaluations = 1500};
  parameters.method = "blockwise-cg";
  // The thesis' stopping rule leaves more than this (fig. 3.4); conjugate gradients with exact gradients get here in
  // some hundred evaluations.
  EXPECT_LE(relative_error(fit(scene, parameters), scene), 1e-3);
}

TEST(TensionFit, errors_are_as_large_as_stated) {
  // 40 repeats of 10 tensions: the mean of (error/sigma)² has a standard deviation of about sqrt(2/40) = 0.22 for one
  // tension and 0.07 for ten independent ones; 0.75 to 1.3 is 3.5 of those.
  double sum = 0;
  int n = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    TensionScene scene = tension_scene("case_21", 1000, 0.07, 100 + seed);
    std::vector<network::CableNetwork> networks;
    networks.emplace_back(scene.cables.network());
    const EnsembleFit result = fit_ensemble(networks, scene.data, scene.adhesion_ids, {.n_meshes = 1}, 2, {});
    for (std::size_t i = 0; i < result.tensions_nN.size(); ++i) {
      if (result.tensions_nN[i].value <= 2 * result.tensions_nN[i].noise) continue;  // the bound t >= 0 skews those
      sum += std::pow(
          (result.tensions_nN[i].value - scene.tensions_nN[static_cast<Eigen::Index>(i)]) / result.tensions_nN[i].noise,
          2);
      ++n;
    }
  }
  EXPECT_GT(n, 200);
  EXPECT_GT(sum / n, 0.75);
  EXPECT_LT(sum / n, 1.3);
}

TEST(TensionFit, the_fit_ends_at_the_same_tensions_from_any_start) {
  const TensionScene scene = tension_scene("case_22", 1000, 0.07, 5);
  const TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const Eigen::VectorXd from_default = fit_gauss_newton(problem, {}, uniform_start_nN(problem)).trial.tensions_nN;
  for (const double start : {1e-4, 1.0, 1e3}) {
    const Eigen::VectorXd from_here =
        fit_gauss_newton(problem, {}, Eigen::VectorXd::Constant(problem.n_tensions(), start)).trial.tensions_nN;
    EXPECT_LE((from_here - from_default).norm(), 1e-4 * from_default.norm()) << "started at " << start << " nN";
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
}  // namespace mbtfm::inverse
