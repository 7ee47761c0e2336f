/// Tensions of a cell that is not of cables: what the fit asks of a model is all that it needs.
#include "network/contractile.h"

#include <Eigen/Dense>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/missing_adhesions.h"
#include "mbtfm/tensions/model_checks.h"
#include "mbtfm/tensions/search.h"
#include "substrate/loads.h"
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
  /// Its ropes keep their directions.
  struct Rigid final : network::GeometryAnswer {
    VectorXd none;
    explicit Rigid(Eigen::Index n_sums) : none(VectorXd::Zero(n_sums)) {}
    VectorXd to_adhesion(int, const std::function<Vec2(Vec2)>&) const override { return none; }
    VectorXd variance_of_free_ends(const VectorXd&, double) const override { return none; }
  };
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
    std::unique_ptr<network::GeometryAnswer> answer_to_geometry(const MatrixXd& weights) const override {
      return std::make_unique<Rigid>(weights.cols());
    }

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

/// A round cell whose ropes run from its adhesions over a nucleus, which pushes the gel down on an ellipse of its own.
struct CellInSpace {
  Cell cell = test::round_cell(14, 12);
  std::vector<int> ids;
  MatrixXd forces;  ///< of unit tensions: x, y and z, into the gel
  VectorXd true_nN;

  CellInSpace() {
    Adhesion nucleus = cell.adhesions.front();
    nucleus.adhesion_id = 99;
    nucleus.position_um = {30, 30};
    nucleus.major_axis_um = nucleus.minor_axis_um = 6;
    const auto n = static_cast<int>(cell.adhesions.size());
    forces = MatrixXd::Zero(3 * (n + 1), 3);
    for (int a = 0; a < n; ++a) {
      const Vec2 d = nucleus.position_um - cell.adhesions[a].position_um;
      const Eigen::Vector3d along = Eigen::Vector3d(d.x, d.y, -5).normalized();  // to its top, 5 um high
      forces.block<3, 1>(3 * a, a % 3) += along;
      forces.block<3, 1>(3 * n, a % 3) -= along;
    }
    cell.adhesions.push_back(nucleus);
    for (const Adhesion& a : cell.adhesions) ids.push_back(a.adhesion_id);
    true_nN = forces * Eigen::Vector3d(2, 5, 3);
  }

  /// By beads in a layer below the surface, as a stack shows them. @param false_um  of one bead, into the gel
  LinearData measured(unsigned seed, double false_um = 0) const {
    constexpr double kNoise_um = 0.05;
    test::Normal normal(seed);
    std::vector<Vec3> beads;
    LinearData data{.held_um = std::vector<double>(ids.size(), 0.0), .has_errors = true, .dimension = 3};
    data.held_um.back() = 5;
    for (int b = 0; b < 1500; ++b) {
      const Vec3 at{30 + 8 * normal(), 30 + 8 * normal(), 0.2 + std::abs(normal())};
      beads.push_back(at), data.position_um.push_back({at.x, at.y}), data.height_um.push_back(-at.z);
    }
    const auto gel = greens::make_greens(test::kGel, {.model = substrate::ModelKind::half_space}, 2);
    data.response =
        gel->response({substrate::ellipses_of(cell.adhesions), 3}, {beads, substrate::Components::all})->kept();
    data.displacement_um = data.response->displace(true_nN);
    for (double& u : data.displacement_um) u += kNoise_um * normal();
    data.displacement_um[2] += false_um;
    data.n_used = data.displacement_um.size();
    data.weight_per_um = VectorXd::Constant(data.n_used, 1 / kNoise_um);
    return reweighted(std::move(data), VectorXd::Ones(1500));
  }

  /// By the true ropes, of beads that move by so much more.
  EnsembleFit fitted(LinearData data, const VectorXd& more_um) const {
    data.displacement_um += more_um;
    return fit_ensemble(std::vector{Ropes(ids, forces)}, reweighted(std::move(data), VectorXd::Ones(1500)), ids,
                        {.loss = Loss::squares}, 2);
  }

  /// Two networks that are not the truth.
  std::vector<Ropes> others(unsigned seed) const {
    test::Normal normal(seed);
    const auto other = [&] { return Ropes(ids, forces.unaryExpr([&](double f) { return f * (1 + 0.2 * normal()); })); };
    return {other(), other()};
  }
};

/// A fit of ropes against linear least squares.
void expect_least_squares(const std::vector<Ropes>& models, const LinearData& data, const MatrixXd& forces,
                          const std::vector<int>& adhesion_ids) {
  const EnsembleFit fit = fit_ensemble(models, data, adhesion_ids, {.loss = Loss::squares}, 2);
  const MatrixXd J = data.weight_per_um.asDiagonal() * data.response->displace(forces);
  const MatrixXd covariance = (J.transpose() * J).inverse();
  const VectorXd expected = covariance * (J.transpose() * data.weight_per_um.cwiseProduct(data.displacement_um));
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

TEST(Contractile, a_model_that_is_linear_is_fitted_as_linear_least_squares_has_it) {
  const Cell cell = test::round_cell(14, 12);
  // gel, beads and noise of the scene; its network is not asked
  test::TensionScene scene = test::scene_of(cell, Eigen::VectorXd::Constant(1, 0.5), 2000, 0.1, 5);
  const MatrixXd forces = ring_and_chords(cell);
  scene.displacement_um = scene.compliance_um_per_nN * (forces * Eigen::Vector3d(2, 5, 3));
  scene.largest_um = scene.displacement_um.cwiseAbs().maxCoeff();
  test::measure(scene, 0.05, 11);
  expect_least_squares({Ropes(scene.adhesion_ids, forces)}, scene.data, forces, scene.adhesion_ids);
}

TEST(Contractile, is_fitted_in_space_as_in_the_plane) {
  const CellInSpace scene;
  expect_least_squares({Ropes(scene.ids, scene.forces)}, scene.measured(3), scene.forces, scene.ids);
}

/// What the beads show beside the networks is found, and the errors hold it.
TEST(Contractile, has_forces_in_space_within_their_errors) {
  const CellInSpace scene;
  constexpr int kDraws = 10;
  double of_forces = 0, of_total = 0, by_budget = 0;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    const std::vector<Ropes> others = scene.others(100 + draw);
    const EnsembleFit fit = fit_ensemble(others, scene.measured(300 + draw), scene.ids, {.loss = Loss::squares}, 2);
    const ErrorBudget budget = error_budget({fit, fit.data, others, scene.cell, test::kGel}, 2);
    by_budget += std::pow((budget.total_force_nN - total_nN(scene.true_nN, 3)) / total(budget.total_force_parts_nN), 2);
    const ErrorParts& parts = budget.tensions[1].parts_nN;
    EXPECT_NEAR(std::hypot(parts.beads, *parts.mesh, parts.model), fit.tensions.nN[1].standard_error, 1e-6);
    for (std::size_t a = 0; a < scene.ids.size(); ++a) {
      const Estimate& found = fit.forces.magnitudes[a];
      const double error_nN = found.value - scene.true_nN.segment<3>(3 * static_cast<Index>(a)).norm();
      of_forces += std::pow(error_nN / found.standard_error, 2) / (kDraws * static_cast<double>(scene.ids.size()));
    }
    const double error_nN = fit.total_force_nN.value - total_nN(scene.true_nN, 3);
    of_total += std::pow(error_nN / fit.total_force_nN.standard_error, 2) / kDraws;
  }
  EXPECT_LT(of_forces, 1.5);
  EXPECT_LT(of_total, 2.3);  // of ten draws: one in a hundred is above
  EXPECT_LT(by_budget / kDraws, 2.3);
}

/// A rope from the first adhesion to the top of the nucleus, or a force between them.
TEST(Contractile, has_what_the_model_lacks_found_in_space) {
  const CellInSpace scene;
  const LinearData data = scene.measured(6);
  VectorXd lacking = VectorXd::Zero(scene.true_nN.size());
  const Vec2 d = Vec2{30, 30} - scene.cell.adhesions[0].position_um;
  lacking.head<3>() = 4 * Eigen::Vector3d(d.x, d.y, -5).normalized();
  lacking.tail<3>() = -lacking.head<3>();
  const std::vector<MissingFibre> ropes =
      missing_fibres(scene.fitted(data, data.response->displace(lacking)), scene.cell.adhesions);
  ASSERT_EQ(ropes.size(), 1u);
  EXPECT_EQ(std::pair(ropes[0].start_adhesion_id, ropes[0].end_adhesion_id), std::pair(scene.ids.front(), 99));
  EXPECT_NEAR(ropes[0].tension_nN, 4, 4 * sigma_nN(ropes[0]));
  constexpr Vec2 kPlace{22.3, 30.4};
  const auto gel = greens::make_greens(test::kGel, {.model = substrate::ModelKind::half_space}, 2);
  const MatrixXd by_force = response_to({{kPlace, 0.6, 0.4, 1}}, places_of_beads(data), 3, *gel)->matrix();
  const std::vector<MissingAdhesion> forces =
      missing_adhesions(scene.fitted(data, by_force * Eigen::Vector3d(1, -1, 3)), scene.cell, test::kGel, 2);
  ASSERT_EQ(forces.size(), 1u);
  EXPECT_LT(norm(forces[0].position_um - kPlace), 1.5) << "places are a micrometre apart";
}

/// By a stage that goes into the gel, and tilts.
TEST(Contractile, is_fitted_beside_a_motion_in_space) {
  const CellInSpace scene;
  const LinearData data = with_more_motions(scene.measured(7), affine_motions(places_of_beads(scene.measured(7))));
  const Eigen::Vector3d planted(0.4, 0.02, -0.01);
  const MatrixXd motions = data.motions.shapes.rightCols<3>();
  const EnsembleFit still = scene.fitted(data, 0 * motions.col(0)), fit = scene.fitted(data, motions * planted);
  EXPECT_LE((values_of(fit) - values_of(still)).norm(), 1e-6 * values_of(still).norm());
  const FoundMotion found = common_motion_among(motions_beside(fit.data, fit), fit.data);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found.out_of_plane[i], planted[i], 4 * found.sigma[6 + i]) << i;
}

TEST(Contractile, is_moved_by_no_false_bead_in_space) {
  const CellInSpace scene;
  const EnsembleFit sound = fit_ensemble(scene.others(1), scene.measured(4), scene.ids, {}, 2);
  const EnsembleFit fit = fit_ensemble(scene.others(1), scene.measured(4, 4), scene.ids, {}, 2);
  EXPECT_EQ(sound.misfit.loss, Loss::squares);
  EXPECT_EQ(fit.misfit.loss, Loss::huber);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(values_of(fit)[i], values_of(sound)[i], 0.3 * sound.tensions.nN[i].standard_error) << i;
}

}  // namespace
}  // namespace mbtfm::tensions
