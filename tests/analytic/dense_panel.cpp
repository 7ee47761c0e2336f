#include <Eigen/Cholesky>

#include "pipeline/numerics/dense_panel.h"
#include "tests/support/test.h"

namespace {

using namespace mbtfm::numerics;

// Sizes about the tile (8 × 4), the chunk (16) and the depth (128) of the kernels.
constexpr int kHeights[] = {1, 2, 7, 8, 9, 16, 18, 31, 128, 150, 290};
// And about the columns (192) and rows (384) that threads share.
constexpr int kLargeHeight = 900, kLargeWidth = 401;

/// The lower triangle of what strips hold; zero above.
template <class Real>
Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic> square_of(const std::vector<Real>& values, std::size_t n) {
  const TriangleStrips strips{n};
  Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic> square(n, n);
  square.setZero();
  for (std::size_t column = 0; column < n; ++column)
    for (std::size_t row = column; row < n; ++row) square(row, column) = values[strips.at(row, column)];
  return square;
}

TEST(TriangleStrips, have_a_place_of_its_own_for_each_number_and_little_more_than_half_the_square) {
  for (const std::size_t n : {0u, 1u, 383u, 384u, 385u, 1200u}) {
    const TriangleStrips strips{n};
    std::vector<int> taken(strips.size());
    for (std::size_t column = 0; column < n; ++column)
      for (std::size_t row = column; row < n; ++row) ASSERT_EQ(taken.at(strips.at(row, column))++, 0);
    EXPECT_LE(strips.size(), n * (n + TriangleStrips::kColumns) / 2);
  }
}

TEST(PartialCholesky, is_the_factor_and_the_schur_complement) {
  for (const int height : kHeights)
    for (const int width : kHeights) {
      if (width > height) continue;
      SCOPED_TRACE(testing::Message() << height << " x " << width);
      const int below = height - width;
      // Eigenvalues from 1 to 1 + height: rounding stays below height² · 1e-16.
      const Eigen::MatrixXd root = Eigen::MatrixXd::Random(height, height);
      const Eigen::MatrixXd a = Eigen::MatrixXd::Identity(height, height) + root * root.transpose() / height;
      const Eigen::MatrixXd whole = a.llt().matrixL();
      Eigen::MatrixXd columns = a.leftCols(width);
      Eigen::MatrixXd change = Eigen::MatrixXd::Constant(below, below, std::numeric_limits<double>::quiet_NaN());
      const std::vector<double> least_pivot(width, 0);
      partial_cholesky<double>({columns.data(), static_cast<std::size_t>(height), static_cast<std::size_t>(width)},
                               least_pivot.data(), change.data());
      const Eigen::MatrixXd lower = columns.triangularView<Eigen::Lower>();
      EXPECT_LT((lower - whole.leftCols(width)).norm(), 1e-11);
      const Eigen::MatrixXd corner = whole.bottomRightCorner(below, below);
      const Eigen::MatrixXd difference = a.bottomRightCorner(below, below) + change - corner * corner.transpose();
      EXPECT_LT(difference.triangularView<Eigen::Lower>().toDenseMatrix().norm(), 1e-11);
    }
}

TEST(PartialCholesky, a_lost_pivot_holds_its_direction_still) {
  Eigen::Matrix3d a;
  a << 4, 2, 2, 2, 1, 1, 2, 1, 5;                            // the second column is half the first
  double change = std::numeric_limits<double>::quiet_NaN();  // what is there before does not count
  Eigen::MatrixXd columns = a.leftCols(2);
  const double least_pivot[] = {1e-14, 1e-14};
  partial_cholesky<double>({columns.data(), 3, 2}, least_pivot, &change);
  EXPECT_EQ(columns(1, 1), std::numeric_limits<double>::infinity());
  EXPECT_EQ(columns(2, 1), 0);
  EXPECT_DOUBLE_EQ(a(2, 2) + change, 4);
}

template <class Real>
struct Results {
  std::vector<Real> columns, change, lower, upper;
  bool operator==(const Results&) const = default;
};

/// Of one matrix: the same numbers at each call.
template <class Real>
Results<Real> results_of(std::size_t height, std::size_t width, std::size_t n_right_hand_sides, int threads,
                         Instructions instructions) {
  std::srand(1);
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix columns = Matrix::Random(static_cast<Eigen::Index>(height), static_cast<Eigen::Index>(width));
  columns.diagonal().array() += static_cast<Real>(height);
  std::vector<Real> change(TriangleStrips{height - width}.size());
  const std::vector<Real> least_pivot(width, 0);
  partial_cholesky<Real>({columns.data(), height, width}, least_pivot.data(), change.data(), threads, instructions);
  Matrix kept = columns.template triangularView<Eigen::Lower>();
  const Matrix kept_change = square_of(change, height - width);
  Matrix start = Matrix::Random(static_cast<Eigen::Index>(n_right_hand_sides), static_cast<Eigen::Index>(height));
  Results<Real> results{{kept.reshaped().begin(), kept.reshaped().end()},
                        {kept_change.reshaped().begin(), kept_change.reshaped().end()},
                        {start.reshaped().begin(), start.reshaped().end()},
                        {start.reshaped().begin(), start.reshaped().end()}};
  const DensePanel<const Real> factor{columns.data(), height, width};
  solve_lower<Real>(factor, results.lower.data(), n_right_hand_sides, instructions);
  solve_upper<Real>(factor, results.upper.data(), n_right_hand_sides, instructions);
  return results;
}

template <class Real>
class Panels : public testing::Test {};
using Scalars = testing::Types<double, float>;
TYPED_TEST_SUITE(Panels, Scalars);

TYPED_TEST(Panels, give_the_same_bits_on_every_processor) {
  const std::vector<Instructions> known = known_instructions();
  for (const auto& [height, width] : {std::pair{kLargeHeight, kLargeWidth}, {290, 150}, {31, 18}, {9, 7}})
    for (const std::size_t n : {std::size_t{1}, 3 * kRightHandSides<TypeParam>})
      for (std::size_t i = 1; i < known.size(); ++i)
        EXPECT_TRUE(results_of<TypeParam>(height, width, n, 1, known[0]) ==
                    results_of<TypeParam>(height, width, n, 1, known[i]))
            << height << " x " << width << ", right-hand sides: " << n;
}

TYPED_TEST(Panels, give_the_same_bits_for_any_number_of_threads) {
  const auto with = [](int threads) {
    return results_of<TypeParam>(kLargeHeight, kLargeWidth, 1, threads, fastest_instructions());
  };
  const Results<TypeParam> one = with(1);
  EXPECT_TRUE(one == with(2) && one == with(4));
}

TYPED_TEST(Panels, large_ones_are_the_factor_too) {
  using Matrix = Eigen::Matrix<TypeParam, Eigen::Dynamic, Eigen::Dynamic>;
  const Matrix root = Matrix::Random(kLargeHeight, kLargeHeight);
  const Matrix a = Matrix::Identity(kLargeHeight, kLargeHeight) + root * root.transpose() / kLargeHeight;
  Matrix columns = a.leftCols(kLargeWidth);
  std::vector<TypeParam> change(TriangleStrips{kLargeHeight - kLargeWidth}.size());
  const std::vector<TypeParam> least_pivot(kLargeWidth, 0);
  partial_cholesky<TypeParam>({columns.data(), kLargeHeight, kLargeWidth}, least_pivot.data(), change.data());
  // height² times rounding
  const double rounding = 1.0 * kLargeHeight * kLargeHeight * std::numeric_limits<TypeParam>::epsilon();
  const Matrix lower = columns.template triangularView<Eigen::Lower>();
  const Matrix whole = a.llt().matrixL();
  EXPECT_LT((lower - whole.leftCols(kLargeWidth)).norm(), rounding);
  const Matrix below = lower.bottomRows(kLargeHeight - kLargeWidth);
  const Matrix difference = square_of(change, kLargeHeight - kLargeWidth) + below * below.transpose();
  EXPECT_LT(Matrix(difference.template triangularView<Eigen::Lower>()).norm(), rounding);
}

TEST(SolvePanel, is_what_the_blocks_of_the_factor_say) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const int height : kHeights)
    for (const int width : kHeights) {
      if (width > height) continue;
      for (const int n : {1, 8, 24}) {
        SCOPED_TRACE(testing::Message() << height << " x " << width << ", right-hand sides: " << n);
        Eigen::MatrixXd factor = Eigen::MatrixXd::Random(height, width) / height;
        for (int j = 0; j < width; ++j) factor(j, j) = 1 + 0.01 * j;
        const Eigen::MatrixXd l1 = factor.topRows(width).triangularView<Eigen::Lower>();
        const Eigen::MatrixXd l2 = factor.bottomRows(height - width);
        for (int j = 1; j < width; ++j) factor.col(j).head(j).setConstant(std::numeric_limits<double>::quiet_NaN());
        const DensePanel<const double> dense{factor.data(), static_cast<std::size_t>(height),
                                             static_cast<std::size_t>(width)};
        const Rows start = Rows::Random(height, n);

        Rows rows = start;
        solve_lower<double>(dense, rows.data(), static_cast<std::size_t>(n));
        EXPECT_LT((l1 * rows.topRows(width) - start.topRows(width)).norm(), 1e-12);
        EXPECT_LT(
            (rows.bottomRows(height - width) + l2 * rows.topRows(width) - start.bottomRows(height - width)).norm(),
            1e-12);

        rows = start;
        solve_upper<double>(dense, rows.data(), static_cast<std::size_t>(n));
        EXPECT_LT((l1.transpose() * rows.topRows(width) + l2.transpose() * start.bottomRows(height - width) -
                   start.topRows(width))
                      .norm(),
                  1e-12);
        EXPECT_EQ(rows.bottomRows(height - width), start.bottomRows(height - width));
      }
    }
}

}  // namespace
