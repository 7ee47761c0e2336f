/// What `refined` promises beyond convergence: the error it reports, layered gels, symmetries, the gel's inside.
#include "substrate/choice/factory.h"
#include "substrate/greens/inside.h"
#include "substrate/greens/layer.h"
#include "substrate/greens/models.h"
#include "substrate/material.h"
#include "tests/support/layered_gel.h"
#include "tests/support/substrate_scene.h"

namespace mbtfm::substrate {
namespace {

using std::numbers::pi;
using test::gel_of;

SubstrateParameters refined_to(double tolerance) {
  SubstrateParameters parameters = test::model_named("refined");
  parameters.displacement_tolerance = tolerance;
  return parameters;
}

double reported_error(const Substrate& model) {
  for (const auto& [name, value] : model.figures())
    if (name == "substrate_estimated_error") return std::get<double>(value);
  ADD_FAILURE() << "no error reported";
  return 0;
}

struct Case {
  double poisson_ratio, thickness_um, tolerance;
  int adhesions;
};

TEST(Refined, reports_its_error_within_a_factor_of_two_and_meets_the_tolerance) {
  for (const Case& c : {Case{0.3, 30, 0.03, 3}, Case{0.49, 30, 0.01, 2}, Case{0.4999, 60, 0.02, 3},
                        Case{0.49, 8, 0.02, 3}, Case{0.4999, 12, 0.02, 1}}) {
    const Gel gel = gel_of(c.poisson_ratio, c.thickness_um);
    const auto points = test::scattered_points(2000, 20);
    const auto ellipses = test::scattered_ellipses(c.adhesions, 15, 7);
    SubstrateParameters parameters = refined_to(c.tolerance);
    const auto model = choice::make_substrate(gel, parameters, 2);
    const Eigen::MatrixXd matrix = model->compliance_um_per_nN(points, ellipses);
    const double error = test::mean_column_difference(
        matrix, greens::make_greens(gel, test::model_named("layer"), 2)->compliance_um_per_nN(points, ellipses));
    const double reported = reported_error(*model);
    EXPECT_LE(reported, c.tolerance);
    EXPECT_LT(reported, 2 * error) << "nu " << c.poisson_ratio << " h " << c.thickness_um;
    EXPECT_GT(reported, error / 2) << "nu " << c.poisson_ratio << " h " << c.thickness_um;
  }
}

TEST(LayeredGel, of_one_modulus_is_the_layer) {
  const Gel gel = gel_of(0.45, 20);
  const test::LayeredGel layered({{5, 8.4}, {3, 8.4}, {12, 8.4}}, 0.45);
  const greens::Layer layer(gel);
  const Ellipse ellipse = {{1, 2}, 1, 0.5, 0.4};
  for (const Vec2 point : {Vec2{1, 2}, Vec2{4, 2}, Vec2{-12, 20}}) {
    const greens::Sym2 a = layered.compliance_um_per_nN(ellipse, point);
    const greens::Sym2 b = greens::LayerEllipse(layer, ellipse).compliance_um_per_nN(point);
    // the layered gel's own averages are of degree 5 over an ellipse of a fifth of its first layer: (1/20)^6 = 2e-8
    EXPECT_NEAR(a.xx, b.xx, 1e-6 * std::abs(b.xx));
    EXPECT_NEAR(a.xy, b.xy, 1e-6 * std::abs(b.xx));
    EXPECT_NEAR(a.yy, b.yy, 1e-6 * std::abs(b.xx));
  }
}

Eigen::MatrixXd compliance(const test::LayeredGel& gel, const std::vector<Vec2>& points,
                           const std::vector<Ellipse>& ellipses) {
  Eigen::MatrixXd matrix(2 * points.size(), 2 * ellipses.size());
  for (std::size_t j = 0; j < ellipses.size(); ++j)
    for (std::size_t i = 0; i < points.size(); ++i) {
      const greens::Sym2 g = gel.compliance_um_per_nN(ellipses[j], points[i]);
      matrix.block<2, 2>(2 * i, 2 * j) << g.xx, g.xy, g.xy, g.yy;
    }
  return matrix;
}

TEST(Refined, takes_layers_and_graded_gels) {
  const double nu = 0.49;
  const auto points = test::scattered_points(150, 15);
  const std::vector<Ellipse> ellipses = {{{1, 2}, 1.2, 0.6, 0.4}};
  const Gel gel = gel_of(nu, 20);
  const Eigen::MatrixXd even =
      greens::make_greens(gel, test::model_named("layer"), 2)->compliance_um_per_nN(points, ellipses);
  std::vector<test::EvenLayer> graded;
  // 20 kPa to 4 kPa: steps of a 24th of the depth differ from the line by less than the tolerance squared
  for (int k = 0; k < 24; ++k) graded.push_back({20.0 / 24, 20 - 16 * (k + 0.5) / 24});
  for (const auto& [profile, layers] :
       {std::pair{std::string("0:20, 6:20, 6:4, 20:4"), std::vector<test::EvenLayer>{{6, 20}, {14, 4}}},
        std::pair{std::string("0:4, 8:4, 8:40"), std::vector<test::EvenLayer>{{8, 4}, {12, 40}}},
        std::pair{std::string("0:20, 20:4"), graded}}) {
    SubstrateParameters parameters = refined_to(0.02);
    parameters.modulus_profile = profile;
    const Eigen::MatrixXd matrix = choice::make_substrate(gel, parameters, 2)->compliance_um_per_nN(points, ellipses);
    const Eigen::MatrixXd exact = compliance(test::LayeredGel(layers, nu), points, ellipses);
    EXPECT_GT(test::mean_column_difference(even, exact), 0.2) << profile;  // not the even gel's
    EXPECT_LT(test::mean_column_difference(matrix, exact), 2 * 0.02) << profile;
  }
}

/// A scene whose rectangle is a square about the origin, so that its mesh turns and mirrors with it.
struct SquareScene {
  std::vector<Vec2> points = test::scattered_points(100, 8);
  std::vector<Ellipse> ellipses = {{{1, 2}, 1.2, 0.6, 0.4}, {{-4, 3}, 0.8, 0.5, 2}};
  SquareScene() {
    for (const Vec2 corner : {Vec2{-9, -9}, Vec2{9, 9}}) points.push_back(corner);
  }
};

TEST(Refined, turns_mirrors_scales_and_superposes_with_the_scene) {
  const Gel gel = gel_of(0.49, 15);
  SubstrateParameters exact = refined_to(0);
  exact.precision = numerics::Precision::double_;
  const auto model = choice::make_substrate(gel, exact, 2);
  const SquareScene scene;
  const Eigen::MatrixXd before = model->compliance_um_per_nN(scene.points, scene.ellipses);
  SquareScene turned, mirrored;
  for (Vec2& p : turned.points) p = {-p.y, p.x};
  for (Vec2& p : mirrored.points) p.x = -p.x;
  for (Ellipse& e : turned.ellipses) {
    e.centre_um = {-e.centre_um.y, e.centre_um.x};
    e.angle_rad += 0.5 * pi;
  }
  for (Ellipse& e : mirrored.ellipses) {
    e.centre_um.x = -e.centre_um.x;
    e.angle_rad = pi - e.angle_rad;
  }
  const Eigen::MatrixXd after = model->compliance_um_per_nN(turned.points, turned.ellipses);
  const Eigen::MatrixXd across = model->compliance_um_per_nN(mirrored.points, mirrored.ellipses);
  Gel stiff = gel;
  stiff.youngs_modulus_kPa *= 3;
  const Eigen::MatrixXd scaled =
      choice::make_substrate(stiff, exact, 2)->compliance_um_per_nN(scene.points, scene.ellipses);
  // solved to rounding times the condition: 1e4 nodes and lambda / mu = 50
  const double tiny = 1e-9 * before.cwiseAbs().maxCoeff();
  EXPECT_LT((3 * scaled - before).cwiseAbs().maxCoeff(), tiny);
  for (Eigen::Index i = 0; i < before.rows(); i += 2)
    for (Eigen::Index j = 0; j < before.cols(); j += 2) {
      EXPECT_NEAR(after(i, j), before(i + 1, j + 1), tiny);
      EXPECT_NEAR(after(i + 1, j), -before(i, j + 1), tiny);
      EXPECT_NEAR(across(i, j), before(i, j), tiny);
      EXPECT_NEAR(across(i + 1, j), -before(i + 1, j), tiny);
    }
  const auto sum = model->displacements_um(scene.points, scene.ellipses, {{1, 2}, {-3, 0.5}});
  const Eigen::VectorXd expected = before * Eigen::Vector4d(1, 2, -3, 0.5);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    EXPECT_NEAR(sum[i].x, expected[2 * i], 4 * tiny);
    EXPECT_NEAR(sum[i].y, expected[2 * i + 1], 4 * tiny);
  }
}

TEST(Refined, is_the_same_for_any_number_of_threads) {
  const SquareScene scene;
  for (const double nu : {0.49, 0.4999}) {  // in single and double precision
    const Gel gel = gel_of(nu, 15);
    const Eigen::MatrixXd one =
        choice::make_substrate(gel, refined_to(0.03), 1)->compliance_um_per_nN(scene.points, scene.ellipses);
    for (const int threads : {2, 4})
      EXPECT_TRUE(
          one ==
          choice::make_substrate(gel, refined_to(0.03), threads)->compliance_um_per_nN(scene.points, scene.ellipses));
  }
}

TEST(Vertical, of_the_half_space_is_the_average_of_the_point_force) {
  const Gel gel = gel_of(0.3, 1000);
  const Ellipse ellipse = {{1, 2}, 1.5, 0.4, 0.7};
  const auto model = choice::make_substrate(gel, test::model_named("half-space"), 1);
  for (const Vec2 point : {Vec2{4, 3}, Vec2{-1, 4}, Vec2{2.5, 0}}) {
    double expected = 0;
    for (const DiscPoint& p : ellipse_rule(ellipse, 99)) {
      const Vec2 offset = point - ellipse.centre_um - p.position;
      const greens::PointForceField field = greens::cerruti_field(gel, offset.x, offset.y, 0);
      expected += p.weight * (2 * field.u_um_per_nN[0][2] - field.u_um_per_nN[1][2]);
    }
    EXPECT_NEAR(model->vertical_um({point}, {ellipse}, {{2, -1}})[0], expected, 1e-9 * std::abs(expected));
  }
  // within, at the rim, continuous: slopes grow as log(1 / distance)
  const Vec2 rim = ellipse.centre_um + 1.5 * Vec2{std::cos(0.7), std::sin(0.7)};
  const Vec2 step = {1e-9 * std::cos(0.7), 1e-9 * std::sin(0.7)};
  const auto near = model->vertical_um({rim - step, rim + step}, {ellipse}, {{2, -1}});
  EXPECT_NEAR(near[0], near[1], 1e-4 * std::abs(near[0]));
}

/// The layer's own transforms against the finite elements' correction on a wide block.
TEST(Vertical, of_layer_and_split_agree) {
  const SquareScene scene;
  const std::vector<Vec2> forces = {{1, 2}, {-3, 0.5}};
  for (const double nu : {0.3, 0.49}) {
    const Gel gel = gel_of(nu, 15);
    SubstrateParameters fine = test::model_named("split");
    fine.cells_per_thickness = 4;
    const auto by_split = choice::make_substrate(gel, fine, 2);
    const auto split = by_split->vertical_um(scene.points, scene.ellipses, forces);
    const auto along = by_split->displacements_um(scene.points, scene.ellipses, forces);
    const auto layer =
        choice::make_substrate(gel, test::model_named("layer"), 2)->vertical_um(scene.points, scene.ellipses, forces);
    double difference = 0, size = 0, vertical = 0;
    for (std::size_t i = 0; i < split.size(); ++i) {
      difference += (split[i] - layer[i]) * (split[i] - layer[i]);
      size += split[i] * split[i] + dot(along[i], along[i]);
      vertical += layer[i] * layer[i];
    }
    EXPECT_LT(std::sqrt(difference / size), 1e-3) << nu;  // the sides, at four thicknesses, change that much
    EXPECT_GT(std::sqrt(vertical / size), 1e-2) << nu;    // it is worth comparing
  }
}

TEST(Vertical, of_a_thick_layer_is_that_of_the_half_space) {
  for (const double nu : {0.0, 0.3, 0.4999}) {
    EXPECT_NEAR(greens::base_down_by_along(nu, 30), 0, 1e-12);
    // long waves shear the layer and move its surface as (kh)²: the base takes the half-space's motion away
    EXPECT_NEAR(greens::base_down_by_along(nu, 0.01), -0.5 * (1 - 2 * nu), 1e-4);
  }
  const std::vector<Vec2> points = {{1, 0.5}, {3, -2}};
  const std::vector<Ellipse> ellipses = {{{0, 0}, 1, 0.5, 0.3}};
  const Gel thick = gel_of(0.3, 1e5);
  const auto layer =
      choice::make_substrate(thick, test::model_named("layer"), 1)->vertical_um(points, ellipses, {{1, 2}});
  const auto half =
      choice::make_substrate(thick, test::model_named("half-space"), 1)->vertical_um(points, ellipses, {{1, 2}});
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(layer[i], half[i], 1e-6 * std::abs(half[i]));
}

TEST(Vertical, of_split_and_refined_agree) {
  const SquareScene scene;
  for (const double nu : {0.3, 0.49}) {
    const Gel gel = gel_of(nu, 15);
    const std::vector<Vec2> forces = {{1, 2}, {-3, 0.5}};
    const auto by_split = choice::make_substrate(gel, test::model_named("split"), 2);
    const auto split = by_split->vertical_um(scene.points, scene.ellipses, forces);
    const auto along = by_split->displacements_um(scene.points, scene.ellipses, forces);
    const auto refined =
        choice::make_substrate(gel, refined_to(0.02), 2)->vertical_um(scene.points, scene.ellipses, forces);
    double difference = 0, size = 0;
    for (std::size_t i = 0; i < split.size(); ++i) {
      difference += (split[i] - refined[i]) * (split[i] - refined[i]);
      size += split[i] * split[i] + dot(along[i], along[i]);
    }
    EXPECT_LT(std::sqrt(difference / size), 2 * 0.02) << nu;  // the tolerance, estimated within a factor of 2
  }
}

/// Force (nN) that the stress carries across the horizontal cut in the middle of each of `n` slices of the gel: of the
/// boxes it meets, stress times area.
std::vector<Vec2> forces_across(const VolumeField& field, double thickness_um, int n) {
  std::vector<Vec2> forces(n);
  for (std::size_t box = 0; box < field.stress_kPa.size(); ++box) {
    const auto& low = field.points_um[field.box_corners[8 * box]];
    const auto& high = field.points_um[field.box_corners[8 * box + 6]];
    const auto& s = field.stress_kPa[box];
    for (int k = 0; k < n; ++k) {
      const double depth = thickness_um * (k + 0.5) / n;
      if (depth > low[2] && depth < high[2]) forces[k] += (high[0] - low[0]) * (high[1] - low[1]) * Vec2{s[5], s[4]};
    }
  }
  return forces;
}

struct Imbalance {
  double mean, rms;  // over all depths, as shares of the load
};

Imbalance imbalance(double poisson_ratio, double growth) {
  SubstrateParameters parameters = refined_to(0);
  parameters.stress = true;
  parameters.precision = numerics::Precision::double_;
  parameters.margin_thicknesses = 1;
  parameters.elements_across_adhesion = 2 / growth;
  parameters.growth = growth;
  const Vec2 load = {2, 1};
  const VolumeField field =
      choice::make_substrate(gel_of(poisson_ratio, 10), parameters, 2)->volume({{{0, 0}, 4, 2, 0.4}}, {load});
  constexpr int kCuts = 128;  // none along a face of boxes, which halve the thickness some five times
  Vec2 sum;
  double squares = 0;
  for (const Vec2 across : forces_across(field, 10, kCuts)) {
    sum += 1.0 / kCuts * (load + across);
    squares += dot(load + across, load + across) / kCuts;
  }
  return {norm(sum) / norm(load), std::sqrt(squares) / norm(load)};
}

TEST(Volume, carries_the_load_down_to_the_base) {
  const double tiny = 1e-8;  // rounding times the condition: lambda / mu = 5000 by the gel's by the boxes' size squared
  for (const double nu : {0.3, 0.4999}) {
    SCOPED_TRACE("nu " + std::to_string(nu));
    // the virtual displacement 1 - z/h belongs to all meshes: as a mean over depth the balance is exact on any; on
    // one of equal boxes every layer's own belongs to it
    EXPECT_LT(imbalance(nu, 2).rms, tiny);
    // where large boxes lie beside small ones each stands for the whole of its height: to first order in their side,
    // but for the block's edges on the base, where the stress is singular: at least to order 1/2
    const Imbalance finer = imbalance(nu, 0.5);
    EXPECT_LT(finer.mean, tiny);
    EXPECT_LT(finer.rms, std::sqrt(0.5) * imbalance(nu, 1).rms);
  }
}

TEST(Volume, holds_the_stress_of_the_half_space_where_the_base_is_far) {
  SubstrateParameters parameters = refined_to(0);
  parameters.stress = true;
  parameters.growth = 0.5;
  for (const double nu : {0.3, 0.4999}) {
    const Gel gel = gel_of(nu, 200);
    const double mu = shear_modulus_kPa(gel), lambda = 2 * mu * nu / (1 - 2 * nu);
    const Ellipse disc = {{0, 0}, 0.8, 0.8, 0};
    const VolumeField field = choice::make_substrate(gel, parameters, 2)->volume({disc}, {{3, 0}});
    ASSERT_EQ(field.stress_kPa.size() * 8, field.box_corners.size());
    double difference = 0, size = 0;
    for (std::size_t box = 0; box < field.stress_kPa.size(); ++box) {
      const auto& low = field.points_um[field.box_corners[8 * box]];
      const auto& high = field.points_um[field.box_corners[8 * box + 6]];
      double x[3];
      for (int k = 0; k < 3; ++k) x[k] = 0.5 * (low[k] + high[k]);
      const double r = std::hypot(x[0], x[1], x[2]);
      if (r < 4 || r > 20) continue;
      const auto g = greens::cerruti_field(gel, x[0], x[1], x[2]).gradient_per_nN[0];
      const double even = lambda * (g[0][0] + g[1][1] + g[2][2]);
      const double exact[6] = {even + 2 * mu * g[0][0],  even + 2 * mu * g[1][1],  even + 2 * mu * g[2][2],
                               mu * (g[0][1] + g[1][0]), mu * (g[1][2] + g[2][1]), mu * (g[0][2] + g[2][0])};
      for (int k = 0; k < 6; ++k) {
        difference += std::pow(field.stress_kPa[box][k] - 3 * exact[k], 2);
        size += std::pow(3 * exact[k], 2);
      }
    }
    // boxes of half their distance: a cell's share of it squared over the slopes' own 24, 1/96, four times over for a
    // field that falls as 1/r²; the point force's own difference from a disc is (0.8/4)²/4
    EXPECT_GT(size, 0);
    EXPECT_LT(std::sqrt(difference / size), 0.05) << nu;
  }
}

}  // namespace
}  // namespace mbtfm::substrate
