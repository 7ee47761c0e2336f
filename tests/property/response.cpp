/// The gel's response as an operator: the blocked one is the dense one but for what far fields lose by interpolation.
#include "substrate/response.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"
#include "tests/support/substrate_scene.h"

namespace mbtfm::substrate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Scene {
  std::vector<Vec2> points;
  std::vector<Ellipse> ellipses;
};

/// Beads all over, and dense in a corner; adhesions of 0.2 to 3 um, some of them far outside.
Scene uneven_scene() {
  std::mt19937_64 random(7);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  Scene s;
  for (int i = 0; i < 500; ++i) s.points.push_back({between(0, 100), between(0, 80)});
  for (int i = 0; i < 150; ++i) s.points.push_back({between(0, 10), between(0, 5)});
  for (int j = 0; j < 30; ++j) {
    const double semi_major = between(0.2, 3);
    s.ellipses.push_back(
        {{between(-20, 120), between(-20, 100)}, semi_major, semi_major * between(0.2, 1), between(0, 3)});
  }
  return s;
}

MatrixXd random_columns(Index rows, Index columns, unsigned seed) {
  std::srand(seed);
  return MatrixXd::Random(rows, columns);
}

MatrixXd whole(const Response& response) {
  return response.displace(MatrixXd::Identity(response.cols(), response.cols()));
}

std::unique_ptr<Substrate> gel(const std::string& model, double thickness_um) {
  return greens::make_greens({.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = thickness_um},
                             {.model = named<ModelKind>(model).value()}, 2);
}

MatrixAt matrix_of(const Substrate& model) {
  return [&model](const std::vector<Vec2>& points, const std::vector<Ellipse>& ellipses) {
    return model.compliance_um_per_nN(points, ellipses);
  };
}

using NamedGel = std::pair<std::string, double>;
class BlockedResponse : public testing::TestWithParam<NamedGel> {
 protected:
  const std::unique_ptr<Substrate> model = gel(GetParam().first, GetParam().second);
  const Scene scene = uneven_scene();
  const SharedResponse blocked = blocked_response(matrix_of(*model), scene.points, scene.ellipses, 2);
  const MatrixXd exact = model->compliance_um_per_nN(scene.points, scene.ellipses);
};

// Trefethen (2013), theorem 8.2: 4 M rho^-n / (rho − 1) with rho = 3 + 2 sqrt(2), n = 6 and M, the largest value in the
// complex ellipse half-way to the source, some twice the field (a thin layer's falls faster: four times), and what the
// common modes leave out: up to 1e-4, for the
// ellipses nearest to a far square.
TEST_P(BlockedResponse, every_ellipse_s_field_is_the_exact_one_but_for_the_far_field_s_interpolation) {
  const MatrixXd G = whole(*blocked);
  for (Index column = 0; column < G.cols(); ++column)
    EXPECT_LE((G - exact).col(column).norm(), 1e-4 * exact.col(column).norm()) << column;
}

TEST_P(BlockedResponse, pulling_back_is_the_transpose_of_displacing) {
  const MatrixXd F = random_columns(blocked->cols(), 3, 1), D = random_columns(blocked->rows(), 4, 2);
  const MatrixXd one = D.transpose() * blocked->displace(F), other = blocked->pull_back(D).transpose() * F;
  EXPECT_LE((one - other).norm(), 1e-12 * one.norm());
}

TEST_P(BlockedResponse, its_gram_matrix_is_that_of_its_own_matrix) {
  const MatrixXd G = whole(*blocked);
  const VectorXd weight = random_columns(G.rows(), 1, 3).cwiseAbs2();
  const MatrixXd wanted = G.transpose() * weight.asDiagonal() * G;
  const MatrixXd found = blocked->upper_gram(weight);
  const MatrixXd difference = (found - wanted).triangularView<Eigen::Upper>();
  EXPECT_LE(difference.norm(), 1e-12 * wanted.norm());
}

TEST_P(BlockedResponse, at_some_of_the_points_it_is_those_rows_in_their_order) {
  const std::vector<Index> some = {570, 3, 649, 0, 42};
  const MatrixXd G = whole(*blocked), part = whole(*blocked->at_points(some));
  ASSERT_EQ(part.rows(), 10);
  for (std::size_t i = 0; i < some.size(); ++i)
    EXPECT_LE((part.middleRows<2>(2 * static_cast<Index>(i)) - G.middleRows<2>(2 * some[i])).norm(), 1e-14);
}

TEST_P(BlockedResponse, the_bits_are_the_same_for_any_number_of_threads) {
  const MatrixXd F = random_columns(blocked->cols(), 2, 4), D = random_columns(blocked->rows(), 2, 5);
  const VectorXd weight = VectorXd::Ones(blocked->rows());
  for (const int threads : {1, 4}) {
    const SharedResponse other = blocked_response(matrix_of(*model), scene.points, scene.ellipses, threads);
    EXPECT_TRUE(blocked->displace(F) == other->displace(F));
    EXPECT_TRUE(blocked->pull_back(D) == other->pull_back(D));
    EXPECT_TRUE(blocked->upper_gram(weight) == other->upper_gram(weight));
  }
}

INSTANTIATE_TEST_SUITE_P(Gels, BlockedResponse,
                         testing::Values(NamedGel{"half-space", 60}, NamedGel{"layer", 60}, NamedGel{"layer", 10}));

TEST(Response, blocks_of_one_point_and_of_many_at_one_place_are_exact) {
  const auto model = gel("layer", 30);
  const Scene scene = uneven_scene();
  for (const std::vector<Vec2>& points : {std::vector<Vec2>{{3, 4}}, std::vector<Vec2>(50, Vec2{3, 4}), {}}) {
    const MatrixXd exact = model->compliance_um_per_nN(points, scene.ellipses);
    const MatrixXd G = whole(*blocked_response(matrix_of(*model), points, scene.ellipses, 1));
    ASSERT_EQ(G.rows(), exact.rows());
    EXPECT_LE((G - exact).norm(), 1e-6 * exact.norm());  // single precision
  }
}

TEST(Response, large_scenes_are_blocked_and_small_ones_exact) {
  const auto model = gel("half-space", 60);
  const Scene scene = uneven_scene();
  EXPECT_TRUE(whole(*model->response({scene.ellipses}, {scene.points})->kept()) ==
              model->compliance_um_per_nN(scene.points, scene.ellipses));
}

}  // namespace
}  // namespace mbtfm::substrate
