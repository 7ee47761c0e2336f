/// Which model the criteria prefer, over many draws of the beads' noise.
#include "mbtfm/tensions/model_checks.h"

#include <Eigen/Cholesky>
#include <random>

#include "mbtfm/tensions/evidence.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

/// One fibre, pulling with this.
test::TensionScene one_fibre(double tension_nN, int n_beads) {
  Cell cell = test::round_cell(8, 6, {{1, 4}});
  return test::scene_of(cell, Eigen::Vector2d(0.3, tension_nN), n_beads, 0.02, 3);
}

std::vector<ModelScore> scores(test::TensionScene& scene) {
  const EnsembleFit fit = test::fit_own_network(scene, {.loss = Loss::squares});
  return compare_models(fit, fit.data, scene.cables, scene.adhesion_ids);
}

TEST(ModelScores, a_parameter_costs_AIC_two_and_BIC_the_logarithm_of_the_number_of_data) {
  for (const int n_beads : {300, 1200}) {
    test::TensionScene scene = one_fibre(2, n_beads);
    for (const ModelScore& model : scores(scene)) {
      EXPECT_NEAR((model.aic - model.chi_squared) / model.n_parameters, 2, 1e-9) << model.name;
      // twice as many displacement components as beads
      EXPECT_NEAR((model.bic - model.chi_squared) / model.n_parameters, std::log(2.0 * n_beads), 1e-9) << model.name;
    }
  }
}

TEST(ModelScores, beads_that_are_pushed_are_explained_best_by_no_tension) {
  test::TensionScene scene = one_fibre(2, 300);
  scene.displacement_um *= -1;
  test::measure(scene, 0.02, 5);
  EnsembleFit nothing;  // of the fit the scores take these alone
  nothing.tensions.fibre_ids = scene.cables.fibre_ids();
  nothing.forces.nN = Eigen::VectorXd::Zero(scene.forces_nN.size());
  const std::vector<ModelScore> models = compare_models(nothing, scene.data, scene.cables, scene.adhesion_ids);
  EXPECT_EQ(models[0].name, "no-fibres");
  EXPECT_EQ(models[0].forces_nN, nothing.forces.nN);
  EXPECT_EQ(models[0].relative_l2, 1);
}

TEST(ModelScores, BIC_prefers_the_network_alone_where_it_is_alone_and_AIC_does_so_less_often) {
  // A fibre that pulls like the network is none. A parameter too many lowers chi² by the square of a normal variable,
  // so AIC takes it where that is above 2, in 16 % of the draws, however many the beads; BIC where it is above
  // ln 1000, in 0.9 %. Of 100 draws more than 4 are that with a chance of 1 in 500, and fewer than 6 of AIC's 16.
  test::TensionScene scene = one_fibre(0.3, 500);
  constexpr int kDraws = 100;
  int n_by_aic = 0, n_by_bic = 0;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    test::measure(scene, 0.02, 100 + draw);
    const std::vector<ModelScore> models = scores(scene);
    ASSERT_EQ(models[0].name, "no-fibres");
    ASSERT_EQ(models[1].name, "full");
    n_by_aic += models[1].aic < models[0].aic;
    n_by_bic += models[1].bic < models[0].bic;
  }
  EXPECT_GE(n_by_aic, 6);
  EXPECT_LE(n_by_aic, 28);
  EXPECT_LE(n_by_bic, 4);
}

TEST(ModelScores, BIC_finds_a_fibre_that_pulls_once_the_beads_are_many) {
  // Its chi² grows with the beads, its price with their logarithm.
  int n_found = 0;
  test::TensionScene scene = one_fibre(2, 2000);
  for (unsigned draw = 0; draw < 10; ++draw) {
    test::measure(scene, 0.02, 300 + draw);
    const std::vector<ModelScore> models = scores(scene);
    n_found += models[1].bic < models[0].bic && models[1].bic < models[2].bic;
  }
  EXPECT_EQ(n_found, 10);
}

/// The density of what the models leave, written out: no identity of Woodbury or Sylvester, no reduction.
double minus_two_log(const test::TensionScene& scene, const Eigen::MatrixXd& G, const Eigen::VectorXd& left_um,
                     double tau_nN) {
  const Eigen::VectorXd left = scene.data.weight_per_um.cwiseProduct(left_um);
  const Eigen::MatrixXd weighted = scene.data.weight_per_um.asDiagonal() * G;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(left.size(), left.size()),
                        covariance =
                            one * noise_variance(scene.data) + tau_nN * tau_nN * weighted * weighted.transpose();
  const Eigen::LLT<Eigen::MatrixXd> root(covariance);
  const double log_noise = std::log(noise_variance(scene.data)) * static_cast<double>(left.size());
  return left.dot(root.solve(left)) + 2 * root.matrixLLT().diagonal().array().log().sum() - log_noise;
}

TEST(ModelScores, with_discrepancy_are_the_normal_density_of_what_a_model_leaves) {
  test::TensionScene scene = one_fibre(2, 60);
  std::vector<ModelScore> models = scores(scene);
  weigh_with_discrepancy(models, scene.data);
  const Eigen::MatrixXd G = scene.data.response->displace(
      Eigen::MatrixXd::Identity(scene.data.response->cols(), scene.data.response->cols()));
  for (const ModelScore& m : models) {
    const bool is_free = m.left_um.size() == 0;
    const double price = is_free ? 0 : m.n_parameters * std::log(120.0);
    const Eigen::VectorXd& left_um = is_free ? scene.data.displacement_um : m.left_um;
    const auto score = [&](double tau_nN) { return minus_two_log(scene, G, left_um, tau_nN) + price; };
    const double tolerance = 1e-9 * std::abs(m.bic_with_discrepancy);
    EXPECT_NEAR(m.bic_with_discrepancy, score(m.discrepancy_nN), tolerance) << m.name;
    for (const double factor : {0.5, 2.0})
      EXPECT_LE(m.bic_with_discrepancy, score(factor * m.discrepancy_nN) + tolerance);
  }
}

TEST(ModelScores, with_discrepancy_prefer_cables_that_are_somewhat_wrong_and_not_those_that_know_nothing) {
  test::TensionScene scene = one_fibre(2, 2000);
  const Eigen::VectorXd exact_um = scene.data.displacement_um;
  const double rms_nN = scene.forces_nN.norm() / std::sqrt(static_cast<double>(scene.forces_nN.size()));
  test::Normal normal(5);
  int n_wrong_by_bic = 0;
  for (const double error : {0.0, 0.1, 0.2}) {
    Eigen::VectorXd beside_nN(scene.forces_nN.size());
    for (double& f : beside_nN) f = error * rms_nN * normal();
    scene.displacement_um = exact_um + scene.data.response->displace(beside_nN);
    test::measure(scene, 0.01, 17);
    std::vector<ModelScore> models = scores(scene);
    weigh_with_discrepancy(models, scene.data);
    EXPECT_LT(models[1].bic_with_discrepancy, models[0].bic_with_discrepancy) << error;
    EXPECT_LT(models[1].bic_with_discrepancy, models[2].bic_with_discrepancy) << error;
    n_wrong_by_bic += models[2].bic < models[1].bic;
    // 12 components: their spread is known to a fifth, the grid has factors of two
    EXPECT_NEAR(std::log2(std::max(models[1].discrepancy_nN, 0.01 * rms_nN) / std::max(error, 0.01) / rms_nN), 0, 1.3);
  }
  EXPECT_GE(n_wrong_by_bic, 1) << "else there was nothing to mend";
}

}  // namespace
}  // namespace mbtfm::tensions
