/// What holds of every model of the gel in the table.
#include "pipeline/contract/errors.h"
#include "substrate/choice/factory.h"
#include "substrate/loads.h"
#include "substrate/response.h"
#include "tests/support/substrate_scene.h"

namespace mbtfm::substrate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

const Gel kThinGel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.45, .thickness_um = 20};

class GelModels : public testing::TestWithParam<std::string> {
 protected:
  GelModels() {
    SubstrateParameters parameters = test::model_named(GetParam());
    parameters.displacement_tolerance = 0;  // one mesh: a mesh for each question is not linear
    model = choice::make_substrate(kThinGel, parameters, 2);
  }
  std::unique_ptr<Substrate> model;
  const std::vector<Vec2> points = test::scattered_points(20, 15);
  const std::vector<Ellipse> ellipses = test::scattered_ellipses(3, 10);
  const std::vector<Vec3> in_space = {{1, 2, 3}, {-8, 4, 19}, {0, 0, 0.2}};
};

std::vector<std::string> names() {
  std::vector<std::string> result = {"auto"};
  for (const Model& model : choice::models()) result.emplace_back(name_of(model.kind));
  return result;
}

TEST_P(GelModels, displace_and_pull_back_are_the_matrix_and_its_transpose) {
  std::srand(1);
  for (const Components components : {Components::along, Components::normal, Components::all}) {
    const Observations observations{points, components};
    const LazyResponse response = model->response({ellipses}, observations);
    const MatrixXd G = response->matrix();
    ASSERT_EQ(G.rows(), observations.n_components() * 20);
    ASSERT_EQ(G.cols(), 6);
    EXPECT_EQ(response->rows(), G.rows());
    EXPECT_EQ(response->cols(), G.cols());
    const MatrixXd forces = MatrixXd::Random(G.cols(), 2), displacements = MatrixXd::Random(G.rows(), 2);
    // refined solves in single precision, whose rounding the condition of a mesh multiplies
    constexpr double kRounding = 1e-4;
    const LazyResponse kept = response->kept();
    for (const LazyResponse& r : {response, kept}) {
      EXPECT_LE((r->displace(forces) - G * forces).norm(), kRounding * (G * forces).norm());
      EXPECT_LE((r->pull_back(displacements) - G.transpose() * displacements).norm(),
                kRounding * (G.transpose() * displacements).norm());
    }
  }
}

TEST_P(GelModels, three_components_are_those_along_the_surface_and_the_one_into_the_gel) {
  const auto matrix = [&](Components components) {
    return model->response({ellipses}, {points, components})->matrix();
  };
  const MatrixXd along = matrix(Components::along), normal = matrix(Components::normal), all = matrix(Components::all);
  for (Index i = 0; i < 20; ++i) {
    EXPECT_LE((all.middleRows(3 * i, 2) - along.middleRows(2 * i, 2)).norm(), 1e-4 * along.norm());
    EXPECT_LE((all.row(3 * i + 2) - normal.row(i)).norm(), 1e-4 * along.norm());
  }
}

TEST_P(GelModels, refuse_what_they_cannot_answer) {
  const SurfaceMesh face{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {{0, 1, 2, 3}}};
  if (!model->capabilities().surface) EXPECT_THROW(model->response({face}, {points}), UsageError);
  if (GetParam() == "auto" || model->capabilities().space) return;
  EXPECT_THROW(model->response({ellipses, 3}, {points}), UsageError);
  EXPECT_THROW(model->response({ellipses}, {in_space}), UsageError);
}

TEST_P(GelModels, answer_to_forces_in_space_as_along_the_surface) {
  if (GetParam() != "auto" && !model->capabilities().space) return;
  std::vector<Vec3> on_surface;
  for (const Vec2 p : points) on_surface.push_back({p.x, p.y, 0});
  const MatrixXd flat = model->response({ellipses}, {points, Components::all})->matrix();
  const MatrixXd same = model->response({ellipses}, {on_surface, Components::all})->matrix();
  EXPECT_LE((same - flat).cwiseAbs().maxCoeff(), 1e-8 * flat.cwiseAbs().maxCoeff());
  // forces into the gel are a third column by ellipse, and rows of single axes those of all
  const LazyResponse response = model->response({ellipses, 3}, {in_space, Components::all});
  const MatrixXd all = response->matrix(), along = model->response({ellipses, 3}, {in_space})->matrix();
  const MatrixXd normal = model->response({ellipses, 3}, {in_space, Components::normal})->matrix();
  const MatrixXd two = model->response({ellipses}, {in_space, Components::all})->matrix();
  const double kRounding = 1e-12 * all.norm();
  for (Index i = 0; i < 3; ++i) {
    EXPECT_LE((all.middleRows(3 * i, 2) - along.middleRows(2 * i, 2)).norm(), kRounding);
    EXPECT_LE((all.row(3 * i + 2) - normal.row(i)).norm(), kRounding);
  }
  for (Index j = 0; j < 3; ++j) EXPECT_LE((all.middleCols(3 * j, 2) - two.middleCols(2 * j, 2)).norm(), kRounding);
  const Eigen::VectorXd forces = Eigen::VectorXd::Random(all.cols()), u = Eigen::VectorXd::Random(all.rows());
  EXPECT_NEAR(u.dot(all * forces), forces.dot(response->pull_back(u).col(0)), 1e-12 * u.norm() * (all * forces).norm());
  EXPECT_THROW(model->response({ellipses}, {std::vector<Vec3>{{1, 2, -0.1}}}), InvalidData);
}

TEST_P(GelModels, have_the_effects_that_they_can) {
  model->compliance_um_per_nN(points, ellipses);
  const Capabilities can = model->capabilities();
  if (can.inside)
    EXPECT_FALSE(model->volume({ellipses.front()}, {{1, 0}}).points_um.empty());
  else if (GetParam() != "auto")
    EXPECT_THROW(model->volume({ellipses.front()}, {{1, 0}}), UsageError);
  EXPECT_EQ(model->effects().front().is_on, can.base);
  EXPECT_LT(model->stated_error(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, GelModels, testing::ValuesIn(names()),
                         [](const auto& test) { return test.param == "half-space" ? "half_space" : test.param; });

TEST(Squares, side_by_side_act_as_one_square) {
  for (const char* name : {"half-space", "layer"}) {
    const auto model = choice::make_substrate(kThinGel, test::model_named(name), 1);
    const std::vector<Vec2> points = {{0.3, 0.2}, {5, 1}, {30, -20}};
    const auto of = [&](const std::vector<Square>& squares) { return model->response({squares}, {points})->matrix(); };
    const MatrixXd quarters = of({{{-1, -1}, 2}, {{-1, 1}, 2}, {{1, -1}, 2}, {{1, 1}, 2}}), whole = of({{{0, 0}, 4}});
    MatrixXd sum = MatrixXd::Zero(6, 2);
    for (Index k = 0; k < 4; ++k) sum += quarters.middleCols(2 * k, 2);
    // the base's part by 2 x 2 points: (side / 4 h)^4
    EXPECT_LE((sum - whole).norm(), 1e-5 * whole.norm()) << name;
  }
}

TEST(Waves, move_the_gel_along_and_across_as_its_function_says) {
  const auto model = choice::make_substrate(kThinGel, test::model_named("layer"), 1);
  const std::vector<Wave> waves = {{{0.3, 0}}, {{0, 0.3}}};
  const std::vector<Vec2> points = {{0, 0}, {std::numbers::pi / 0.3, 0}};
  const MatrixXd u = model->response({waves}, {points})->matrix();
  EXPECT_NEAR(u(0, 0), u(1, 3), 1e-12);                       // along either axis
  EXPECT_NEAR(u(1, 1), u(0, 2), 1e-12);                       // across
  EXPECT_NEAR(u(2, 0), -u(0, 0), 1e-12 * std::abs(u(0, 0)));  // half a wave further
  EXPECT_NEAR(u(2, 2), u(0, 2), 1e-12);                       // along the crest
  EXPECT_EQ(u(1, 0), 0);
}

}  // namespace
}  // namespace mbtfm::substrate
