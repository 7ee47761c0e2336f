/// Symmetries of the half-space and the layer.
#include "substrate/greens/layer.h"
#include "substrate/greens/models.h"
#include "tests/support/substrate_scene.h"

namespace mbtfm::substrate {
namespace {

using std::numbers::pi;

const Gel kGel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 30};
// two ways to the same number differ by what the layer's averages leave out
constexpr double kLeftOut = 1e-8;

class ClosedForm : public testing::TestWithParam<const char*> {
 protected:
  Eigen::MatrixXd compliance(const Gel& gel, const std::vector<Vec2>& points, const std::vector<Ellipse>& ellipses,
                             int threads = 2) const {
    return greens::make_greens(gel, test::model_named(GetParam()), threads)->compliance_um_per_nN(points, ellipses);
  }
};

TEST_P(ClosedForm, is_the_same_for_any_number_of_threads) {
  const auto points = test::scattered_points(50, 40);
  const auto ellipses = test::scattered_ellipses(7, 30);
  EXPECT_EQ(compliance(kGel, points, ellipses, 1), compliance(kGel, points, ellipses, 4));
}

TEST_P(ClosedForm, turns_with_the_scene) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    auto points = test::scattered_points(60, 40, {}, seed);
    auto ellipses = test::scattered_ellipses(5, 30, seed);
    const Eigen::MatrixXd before = compliance(kGel, points, ellipses);
    for (Vec2& p : points) p = {-p.y, p.x};
    for (Ellipse& e : ellipses) {
      e.centre_um = {-e.centre_um.y, e.centre_um.x};
      e.angle_rad += 0.5 * pi;
    }
    const Eigen::MatrixXd after = compliance(kGel, points, ellipses);
    for (Eigen::Index i = 0; i < before.rows(); i += 2)
      for (Eigen::Index j = 0; j < before.cols(); j += 2) {
        const double size = before.block<2, 2>(i, j).norm();
        EXPECT_NEAR(after(i, j), before(i + 1, j + 1), kLeftOut * size);
        EXPECT_NEAR(after(i + 1, j + 1), before(i, j), kLeftOut * size);
        EXPECT_NEAR(after(i + 1, j), -before(i, j + 1), kLeftOut * size);
      }
  }
}

TEST_P(ClosedForm, mirrors_with_the_scene) {
  auto points = test::scattered_points(60, 40);
  auto ellipses = test::scattered_ellipses(5, 30);
  const Eigen::MatrixXd before = compliance(kGel, points, ellipses);
  for (Vec2& p : points) p.x = -p.x;
  for (Ellipse& e : ellipses) {
    e.centre_um.x = -e.centre_um.x;
    e.angle_rad = pi - e.angle_rad;
  }
  const Eigen::MatrixXd after = compliance(kGel, points, ellipses);
  for (Eigen::Index i = 0; i < before.rows(); ++i)
    for (Eigen::Index j = 0; j < before.cols(); ++j) {
      const double sign = (i + j) % 2 == 0 ? 1 : -1;
      const double size = before.block<2, 2>(i / 2 * 2, j / 2 * 2).norm();
      EXPECT_NEAR(after(i, j), sign * before(i, j), kLeftOut * size);
    }
}

TEST_P(ClosedForm, scales_with_one_over_the_modulus) {
  const auto points = test::scattered_points(20, 40);
  const auto ellipses = test::scattered_ellipses(3, 30);
  Gel stiff = kGel;
  stiff.youngs_modulus_kPa *= 4;  // a power of two: exact
  EXPECT_EQ(compliance(kGel, points, ellipses), 4 * compliance(stiff, points, ellipses));
}

TEST_P(ClosedForm, has_no_length_but_the_scenes_own) {
  auto points = test::scattered_points(20, 40);
  auto ellipses = test::scattered_ellipses(3, 30);
  const Eigen::MatrixXd before = compliance(kGel, points, ellipses);
  Gel gel = kGel;
  gel.thickness_um *= 2;  // all lengths doubled: half the displacement for the same force
  for (Vec2& p : points) p = 2 * p;
  for (Ellipse& e : ellipses) e = {2 * e.centre_um, 2 * e.semi_major_um, 2 * e.semi_minor_um, e.angle_rad};
  EXPECT_LT((2 * compliance(gel, points, ellipses) - before).norm(), 1e-13 * before.norm());
}

TEST_P(ClosedForm, is_reciprocal_between_two_loaded_ellipses) {
  // the mean displacement of ellipse B by a force on A is that of A by the same force on B
  const std::vector<Ellipse> pair = {{{0, 0}, 2.0, 0.5, 0.3}, {{3.1, 1.2}, 1.5, 0.8, 2.0}};
  Eigen::Matrix2d mean[2];
  for (int loaded = 0; loaded < 2; ++loaded) {
    const auto rule = ellipse_rule(pair[1 - loaded], 59);
    std::vector<Vec2> points;
    for (const DiscPoint& p : rule) points.push_back(pair[1 - loaded].centre_um + p.position);
    const Eigen::MatrixXd g = compliance(kGel, points, {pair[loaded]});
    mean[loaded].setZero();
    for (std::size_t k = 0; k < rule.size(); ++k) mean[loaded] += rule[k].weight * g.middleRows<2>(2 * k);
  }
  EXPECT_LT((mean[0] - mean[1].transpose()).norm(), kLeftOut * mean[0].norm());
}

TEST_P(ClosedForm, forces_superpose) {
  const auto points = test::scattered_points(30, 40);
  const auto ellipses = test::scattered_ellipses(4, 30);
  const std::vector<Vec2> forces = {{1, 2}, {-3, 0.5}, {0, 0}, {2, -1}};
  const auto model = greens::make_greens(kGel, test::model_named(GetParam()), 2);
  const Eigen::MatrixXd g = model->compliance_um_per_nN(points, ellipses);
  const auto sum = model->displacements_um(points, ellipses, forces);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector2d expected = Eigen::Vector2d::Zero();
    for (std::size_t j = 0; j < forces.size(); ++j)
      expected += g.block<2, 2>(2 * i, 2 * j) * Eigen::Vector2d(forces[j].x, forces[j].y);
    EXPECT_NEAR(sum[i].x, expected[0], 1e-14);
    EXPECT_NEAR(sum[i].y, expected[1], 1e-14);
  }
}

INSTANTIATE_TEST_SUITE_P(Models, ClosedForm, testing::Values("half-space", "layer"),
                         [](const auto& test) { return test.index == 0 ? "half_space" : "layer"; });

TEST(Layer, tends_to_the_half_space_as_it_grows_thick) {
  const auto points = test::scattered_points(50, 10);
  const auto ellipses = test::scattered_ellipses(3, 8);
  const Eigen::MatrixXd limit =
      greens::make_greens(kGel, test::model_named("half-space"), 1)->compliance_um_per_nN(points, ellipses);
  double previous = 0;
  for (const double thickness : {1e2, 1e3, 1e4}) {
    Gel gel = kGel;
    gel.thickness_um = thickness;
    const Eigen::MatrixXd layer =
        greens::make_greens(gel, test::model_named("layer"), 1)->compliance_um_per_nN(points, ellipses);
    const double difference = (layer - limit).norm();
    // the correction is a constant over h to leading order, the next term in (r/h)²: 1/10 to (20/100)² at first
    if (previous > 0) EXPECT_NEAR(difference / previous, 0.1, 0.1 * 0.04);
    previous = difference;
  }
}

TEST(IncompressibleGel, is_the_limit_of_nearly_incompressible_ones) {
  const Gel incompressible{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.5, .thickness_um = 20};
  const Gel nearly{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.4999, .thickness_um = 20};
  const Ellipse ellipse = {{0, 0}, 1, 0.5, 0};
  const std::vector<Vec2> points = {{0, 0}, {3, 1}, {20, 5}};
  for (const ModelKind model : {ModelKind::half_space, ModelKind::layer}) {
    const auto compliance = [&](const Gel& gel) {
      return greens::make_greens(gel, {.model = model}, 1)->compliance_um_per_nN(points, {ellipse});
    };
    // smooth in nu: 1e-4 of it changes the compliance by some 1e-4; a layer's own numbers are right to as much
    EXPECT_LE((compliance(incompressible) - compliance(nearly)).norm(), 2e-3 * compliance(nearly).norm())
        << name_of(model);
  }
}

}  // namespace
}  // namespace mbtfm::substrate
