#include "pipeline/numerics/dense_panel.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>
#include <vector>

namespace {

using namespace mbtfm::numerics;

// Sizes about the tile (8 × 4), the chunk (16) and the depth (128) of the kernels.
constexpr int kHeights[] = {1, 2, 7, 8, 9, 16, 18, 31, 128, 150, 290};

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
      mbtfm::numerics::partial_cholesky(
          {columns.data(), static_cast<std::size_t>(height), static_cast<std::size_t>(width)}, least_pivot.data(),
          change.data());
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
  mbtfm::numerics::partial_cholesky({columns.data(), 3, 2}, least_pivot, &change);
  EXPECT_EQ(columns(1, 1), std::numeric_limits<double>::infinity());
  EXPECT_EQ(columns(2, 1), 0);
  EXPECT_DOUBLE_EQ(a(2, 2) + change, 4);
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
        const mbtfm::numerics::DenseFactor dense{factor.data(), static_cast<std::size_t>(height),
                                                 static_cast<std::size_t>(width)};
        const Rows start = Rows::Random(height, n);

        Rows rows = start;
        mbtfm::numerics::solve_lower(dense, rows.data(), static_cast<std::size_t>(n));
        EXPECT_LT((l1 * rows.topRows(width) - start.topRows(width)).norm(), 1e-12);
        EXPECT_LT(
            (rows.bottomRows(height - width) + l2 * rows.topRows(width) - start.bottomRows(height - width)).norm(),
            1e-12);

        rows = start;
        mbtfm::numerics::solve_upper(dense, rows.data(), static_cast<std::size_t>(n));
        EXPECT_LT((l1.transpose() * rows.topRows(width) + l2.transpose() * start.bottomRows(height - width) -
                   start.topRows(width))
                      .norm(),
                  1e-12);
        EXPECT_EQ(rows.bottomRows(height - width), start.bottomRows(height - width));
      }
    }
}

}  // namespace
