/// Tensions of a cell that is not of cables: what the fit asks of a model is all that it needs.
#include "network/contractile.h"

#include <Eigen/Dense>

#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Straight ropes between adhesions, and a rope of all labels 0: forces are the tensions times their directions.
class Ropes final : public network::Contractile {
 public:
  Ropes(std::vector<int> adhesion_ids, MatrixXd force_of_unit_tension)
      : adhesion_ids_(std::move(adhesion_ids)), forces_(std::move(force_of_unit_tension)) {
    for (Eigen::Index i = 0; i < forces_.cols(); ++i) fibre_ids_.push_back(static_cast<int>(i));
  }
  const std::vector<int>& fibre_ids() const override { return fibre_ids_; }
  const std::vector<int>& adhesion_ids() const override { return adhesion_ids_; }
  bool is_cut() const override { return false; }
  std::shared_ptr<const network::AtRest> at_rest(const VectorXd& tensions_nN, const network::AtRest*,
                                                 std::optional<double>) const override {
    return std::make_shared<Taut>(forces_, tensions_nN);
  }

 private:
  class Taut final : public network::AtRest {
   public:
    Taut(MatrixXd forces, VectorXd tensions_nN) : forces_(std::move(forces)), tensions_nN_(std::move(tensions_nN)) {
      report_.converged = true;
    }
    const Report& report() const override { return report_; }
    double imbalance_nN() const override { return 0; }
    VectorXd forces_nN() const override { return forces_ * tensions_nN_; }
    VectorXd network_part_nN() const override { return forces_.col(0) * tensions_nN_[0]; }
    VectorXd torques_nN_um() const override { return VectorXd::Zero(forces_.rows() / 2); }
    network::CutReaction cut_reaction() const override { return {}; }
    MatrixXd force_derivatives(int) const override { return forces_; }
    std::unique_ptr<network::GeometryAnswer> answer_to_geometry(const MatrixXd&) const override { return {}; }

   private:
    MatrixXd forces_;
    VectorXd tensions_nN_;
    Report report_;
  };
  std::vector<int> fibre_ids_, adhesion_ids_;
  MatrixXd forces_;
};

/// Of a round cell: a ring from adhesion to adhesion, and two chords.
MatrixXd ring_and_chords(const Cell& cell) {
  const auto n = static_cast<int>(cell.adhesions.size());
  MatrixXd forces = MatrixXd::Zero(2 * n, 3);
  const auto pull = [&](int column, int a, int b) {
    const Vec2 d = cell.adhesions[b].position_um - cell.adhesions[a].position_um;
    const Eigen::Vector2d along = Eigen::Vector2d(d.x, d.y).normalized();
    forces.block<2, 1>(2 * a, column) += along;
    forces.block<2, 1>(2 * b, column) -= along;
  };
  for (int a = 0; a < n; ++a) pull(0, a, (a + 1) % n);
  pull(1, 0, n / 2);
  pull(2, 1, n / 2 - 2);
  return forces;
}

TEST(Contractile, a_model_that_is_linear_is_fitted_as_linear_least_squares_has_it) {
  const Cell cell = test::round_cell(14, 12);
  // gel, beads and noise of the scene; its network is not asked
  test::TensionScene scene = test::scene_of(cell, Eigen::VectorXd::Constant(1, 0.5), 2000, 0.1, 5);
  const MatrixXd forces = ring_and_chords(cell);
  const VectorXd truth = Eigen::Vector3d(2, 5, 3);
  scene.displacement_um = scene.compliance_um_per_nN * (forces * truth);
  scene.largest_um = scene.displacement_um.cwiseAbs().maxCoeff();
  test::measure(scene, 0.05, 11);

  const std::vector<Ropes> models{Ropes(scene.adhesion_ids, forces)};
  const EnsembleFit fit = fit_ensemble(models, scene.data, scene.adhesion_ids, {.loss = Loss::squares}, 2);

  const double sigma_um = scene.beads.front().sigma_um;
  const MatrixXd J = scene.compliance_um_per_nN * forces / sigma_um;
  VectorXd y(J.rows());
  for (std::size_t b = 0; b < scene.beads.size(); ++b)
    y.segment<2>(2 * static_cast<Eigen::Index>(b)) << scene.beads[b].displacement_um.x / sigma_um,
        scene.beads[b].displacement_um.y / sigma_um;
  const MatrixXd covariance = (J.transpose() * J).inverse();
  const VectorXd expected = covariance * (J.transpose() * y);
  ASSERT_TRUE(fit.report.converged);
  for (int i = 0; i < 3; ++i) {
    const double sigma = std::sqrt(covariance(i, i) * fit.misfit.variance);
    // the fit stops where a step moves less than a hundredth of the standard errors
    EXPECT_NEAR(values_of(fit)[i], expected[i], 0.05 * sigma) << i;
    EXPECT_NEAR(std::sqrt(fit.tensions.covariance_nN2(i, i)), sigma, 1e-3 * sigma) << i;
    EXPECT_NEAR(interval_95(fit.tensions.nN[i]).high - expected[i], 1.96 * sigma, 0.07 * sigma);
  }
  EXPECT_NEAR((fit.forces.nN - forces * values_of(fit)).norm(), 0, 1e-9 * fit.forces.nN.norm());
}

}  // namespace
}  // namespace mbtfm::tensions
