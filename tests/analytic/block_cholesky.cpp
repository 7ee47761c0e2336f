/// One factorisation, over the sizes of blocks and scalars that the stages use.
#include <Eigen/Cholesky>

#include "pipeline/numerics/block_cholesky.h"
#include "pipeline/numerics/dense_panel.h"
#include "tests/support/test.h"

namespace mbtfm::numerics {
namespace {

template <int kSize, class Scalar>
struct Kind {
  static constexpr int kBlock = kSize;
  using Real = Scalar;
};

template <class Kind>
class OverKinds : public testing::Test {};
using Kinds = testing::Types<Kind<2, double>, Kind<3, double>, Kind<3, float>>;
TYPED_TEST_SUITE(OverKinds, Kinds);

/// A lattice of side² nodes with its diagonals: springs of random strength and direction, on the ground with `ground`.
template <int kBlock>
BlockMatrix<kBlock> lattice(int side, double ground) {
  BlockMatrix<kBlock> m;
  m.n = side * side;
  m.start = {0};
  for (int node = 0; node < m.n; ++node) {
    const int x = node % side, y = node / side;
    m.row.push_back(node);
    if (x + 1 < side) m.row.push_back(node + 1);
    if (y + 1 < side && x > 0) m.row.push_back(node + side - 1);
    if (y + 1 < side) m.row.push_back(node + side);
    m.start.push_back(static_cast<int>(m.row.size()));
  }
  m.value.assign(kBlock * kBlock * m.row.size(), 0);
  using Block = Eigen::Matrix<double, kBlock, kBlock, Eigen::RowMajor>;
  const auto block = [&](int row, int column) { return Eigen::Map<Block>(m.block(row, column)); };
  std::srand(1);
  for (int node = 0; node < m.n; ++node) {
    block(node, node) += ground * Block::Identity();
    for (int k = m.start[node] + 1; k < m.start[node + 1]; ++k) {
      const Block root = Block::Random(), turned = Block::Random();  // not symmetric: a transposed block would show
      block(m.row[k], m.row[k]) += root * root.transpose();
      block(node, node) += turned * turned.transpose();
      block(m.row[k], node) += root * turned.transpose();
    }
  }
  return m;
}

template <int kBlock>
Eigen::MatrixXd dense(const BlockMatrix<kBlock>& m) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(kBlock * m.n, kBlock * m.n);
  for (int column = 0; column < m.n; ++column)
    for (int k = m.start[column]; k < m.start[column + 1]; ++k)
      for (int p = 0; p < kBlock; ++p)
        for (int q = 0; q < kBlock; ++q) {
          const double value = m.value[kBlock * (kBlock * k + p) + q];
          result(kBlock * m.row[k] + p, kBlock * column + q) = value;
          result(kBlock * column + q, kBlock * m.row[k] + p) = value;
        }
  return result;
}

TEST(Elimination, takes_each_panel_once_after_its_children_in_several_stages) {
  const Elimination elimination(lattice<2>(60, 1), Search::quick);
  std::vector<int> taken(elimination.panels.size());
  const auto take = [&](int k) {
    ++taken[k];
    for (const int child : elimination.panels[k].children) EXPECT_EQ(taken[child], 1) << "before " << k;
  };
  for (const Elimination::Stage& stage : elimination.stages) {
    for (const std::vector<int>& subtree : stage.subtrees) std::for_each(subtree.begin(), subtree.end(), take);
    std::for_each(stage.above.begin(), stage.above.end(), take);
  }
  EXPECT_EQ(std::count(taken.begin(), taken.end(), 1), std::ssize(taken));
  EXPECT_GT(elimination.stages.size(), 2u);
}

TYPED_TEST(OverKinds, solves_what_the_dense_matrix_solves) {
  using Real = typename TypeParam::Real;
  constexpr int kBlock = TypeParam::kBlock;
  using Rows = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const int side : {1, 2, 5, 30}) {
    const BlockMatrix<kBlock> matrix = lattice<kBlock>(side, 1);
    const Eigen::MatrixXd a = dense(matrix);
    BlockCholesky<kBlock, Real> factor(std::make_shared<const Elimination>(matrix, Search::quick));
    ASSERT_TRUE(factor.factorise(matrix, {}));
    for (const std::size_t n : {std::size_t{1}, kRightHandSides<Real>}) {
      Rows x = Rows::Random(kBlock * matrix.n, static_cast<Eigen::Index>(n)), in_order = x;
      const auto move = [&](Rows& from, Rows& to, bool is_back) {
        for (int node = 0; node < matrix.n; ++node) {
          const int place = factor.elimination().place[node];
          to.middleRows(kBlock * (is_back ? node : place), kBlock) =
              from.middleRows(kBlock * (is_back ? place : node), kBlock);
        }
      };
      const Eigen::MatrixXd right = x.template cast<double>();
      move(x, in_order, false);
      factor.solve(in_order.data(), n);
      move(in_order, x, true);
      // eigenvalues from 1 to some 20: rounding, with the square root of the number of unknowns
      const double rounding = 100 * std::sqrt(1.0 * kBlock * matrix.n) * std::numeric_limits<Real>::epsilon();
      EXPECT_LT((a * x.template cast<double>() - right).norm(), rounding * right.norm()) << "side " << side;
    }
  }
}

TYPED_TEST(OverKinds, gives_the_same_bits_for_any_number_of_threads) {
  constexpr int kBlock = TypeParam::kBlock;
  const BlockMatrix<kBlock> matrix = lattice<kBlock>(60, 0.1);
  const auto elimination = std::make_shared<const Elimination>(matrix, Search::quick);
  const auto with = [&](int threads) {
    BlockCholesky<kBlock, typename TypeParam::Real> factor(elimination);
    EXPECT_TRUE(factor.factorise(matrix, {.threads = threads}));
    std::vector<typename TypeParam::Real> below;  // what is above the diagonal is anything
    for (const EliminationPanel& panel : elimination->panels) {
      const std::size_t height = kBlock * panel.height();
      for (std::size_t j = 0; j < kBlock * static_cast<std::size_t>(panel.n_columns); ++j)
        for (std::size_t i = j; i < height; ++i)
          below.push_back(factor.factor()[static_cast<Eigen::Index>(kBlock * kBlock * panel.at + j * height + i)]);
    }
    return below;
  };
  const auto one = with(1);
  EXPECT_TRUE(one == with(2) && one == with(4));
}

TYPED_TEST(OverKinds, refuses_a_matrix_without_stiffness_somewhere_or_holds_that_still) {
  constexpr int kBlock = TypeParam::kBlock;
  using Real = typename TypeParam::Real;
  BlockMatrix<kBlock> matrix = lattice<kBlock>(4, 1);
  for (const int node : {5, 15})  // two nodes that nothing holds along the last axis
    for (int column = 0; column < matrix.n; ++column)
      for (int k = matrix.start[column]; k < matrix.start[column + 1]; ++k)
        for (int p = 0; p < kBlock; ++p) {
          double* block = &matrix.value[kBlock * kBlock * k];
          if (matrix.row[k] == node) block[kBlock * (kBlock - 1) + p] = 0;
          if (column == node) block[kBlock * p + kBlock - 1] = 0;
        }
  BlockCholesky<kBlock, Real> factor(std::make_shared<const Elimination>(matrix, Search::quick));
  for (const int threads : {1, 2}) {
    EXPECT_FALSE(factor.factorise(matrix, {.threads = threads}));
    ASSERT_TRUE(factor.factorise(matrix, {.lost_pivot = LostPivot::holds_still, .threads = threads}));
    std::vector<Real> x(static_cast<std::size_t>(kBlock * matrix.n), 1);
    factor.solve(x.data(), 1);
    for (int node = 0; node < matrix.n; ++node) {
      const Real last = x[kBlock * factor.elimination().place[node] + kBlock - 1];
      EXPECT_EQ(last == 0, node == 5 || node == 15) << node;
    }
  }
}

}  // namespace
}  // namespace mbtfm::numerics
