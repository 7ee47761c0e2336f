/// Large dense products against Eigen's own, about the sizes at which they are cut in pieces.
#include "pipeline/numerics/dense.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "pipeline/numerics/triangle.h"

namespace mbtfm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Rounding of sums of some hundred products of numbers up to 1.
constexpr double kRounding = 1e-12;

MatrixXd numbers(int rows, int columns, unsigned seed) {
  std::srand(seed);
  return MatrixXd::Random(rows, columns);
}

class Dense : public testing::TestWithParam<int> {};

TEST_P(Dense, products_are_those_of_the_textbook) {
  const int n = GetParam();
  const MatrixXd A = numbers(n, 7, 1), B = numbers(7, n, 2), C = numbers(n, 5, 3);
  EXPECT_LE((numerics::product(A, B) - A.lazyProduct(B)).norm(), kRounding * (1 + n));
  EXPECT_LE((numerics::transposed_product(A, C) - A.transpose().lazyProduct(C)).norm(), kRounding * (1 + n));
  EXPECT_LE((numerics::gram(B) - B.transpose().lazyProduct(B)).norm(), kRounding * (1 + n));
  MatrixXd outer = MatrixXd::Identity(n, n);
  numerics::add_upper_outer(A, outer);
  numerics::mirror_upper(outer);
  EXPECT_LE((outer - MatrixXd::Identity(n, n) - A.lazyProduct(A.transpose())).norm(), kRounding * (1 + n));
}

TEST_P(Dense, gram_adds_to_the_upper_half_alone_and_may_take_away) {
  const int n = GetParam();
  const MatrixXd A = numbers(6, n, 4), before = numbers(n, n, 5);
  MatrixXd square = before;
  numerics::add_upper_gram(A, square, 2, -2.0);
  const MatrixXd wanted = before - 2 * A.transpose().lazyProduct(A);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) EXPECT_NEAR(square(i, j), i > j ? before(i, j) : wanted(i, j), i > j ? 0 : kRounding);
}

TEST_P(Dense, cholesky_s_factor_squares_to_the_matrix_and_solves_with_it) {
  const int n = GetParam();
  MatrixXd A = numerics::gram(numbers(n + 3, n, 6));
  A.diagonal().array() += n;  // well conditioned
  MatrixXd U = A;
  ASSERT_TRUE(numerics::upper_cholesky(U));
  EXPECT_EQ(MatrixXd(U.triangularView<Eigen::StrictlyLower>()), MatrixXd(A.triangularView<Eigen::StrictlyLower>()));
  numerics::clear_below_diagonal(U);
  EXPECT_LE((U.transpose() * U - A).norm(), kRounding * (1 + A.norm()));
  const MatrixXd B = numbers(n, 3, 7);
  MatrixXd X = B;
  numerics::solve_upper_transposed(U, X);
  numerics::solve_upper(U, X);
  EXPECT_LE((A * X - B).norm(), kRounding * (1 + n));
  MatrixXd Y = B;
  numerics::multiply_upper(U, Y);
  EXPECT_LE((Y - U.lazyProduct(B)).norm(), kRounding * (1 + n) * U.norm());
}

TEST_P(Dense, the_bits_are_the_same_for_any_number_of_threads) {
  const int n = GetParam();
  const MatrixXd A = numbers(9, n, 8), B = numbers(n, n, 9);
  const MatrixXd one_gram = numerics::gram(A, 1), one_product = numerics::product(A, B, 1);
  for (const int threads : {2, 4}) {
    EXPECT_TRUE(one_gram == numerics::gram(A, threads));
    EXPECT_TRUE(one_product == numerics::product(A, B, threads));
    MatrixXd one_factor = numerics::gram(B), factor = one_factor;
    one_factor.diagonal().array() += 1;
    factor.diagonal().array() += 1;
    EXPECT_TRUE(numerics::upper_cholesky(one_factor, 1) && numerics::upper_cholesky(factor, threads));
    EXPECT_TRUE(one_factor == factor);
  }
}

TEST_P(Dense, a_downdated_factor_is_that_of_the_difference) {
  const int n = GetParam();
  const MatrixXd B = numbers(3, n, 10);
  MatrixXd A = numerics::gram(numbers(n + 5, n, 11)) + MatrixXd::Identity(n, n);
  MatrixXd factor = A + B.transpose().lazyProduct(B);
  ASSERT_TRUE(numerics::upper_cholesky(factor) && numerics::upper_cholesky(A));
  numerics::clear_below_diagonal(factor);
  numerics::clear_below_diagonal(A);
  EXPECT_TRUE(numerics::downdate_upper(factor, B));
  EXPECT_LE((factor - A).norm(), 1e-12 * n * A.norm());
  if (n == 0) return;
  EXPECT_FALSE(numerics::downdate_upper(A, 2 * A.topRows(1)));
}

TEST_P(Dense, triangles_give_what_full_matrices_give) {
  const int n = GetParam();
  const MatrixXd U = numbers(n, n, 12).triangularView<Eigen::Upper>();
  const VectorXd weight = numbers(n, 1, 13).cwiseAbs2();
  const MatrixXd wanted = MatrixXd::Identity(n, n) + U.lazyProduct(weight.asDiagonal() * U.transpose());
  MatrixXd R = MatrixXd::Identity(n, n), of_one_thread = R;
  numerics::add_triangle_outer(U, weight, R, 2);
  numerics::add_triangle_outer(U, weight, of_one_thread);
  ASSERT_TRUE(numerics::upper_root(R, 2) && numerics::upper_root(of_one_thread));
  const MatrixXd root = R.triangularView<Eigen::Upper>();
  EXPECT_LE((root.lazyProduct(root.transpose()) - wanted).norm(), kRounding * (1 + n) * wanted.norm());
  numerics::divide_into(U, R, 2);
  numerics::divide_into(U, of_one_thread);
  EXPECT_TRUE(R == of_one_thread) << "the bits of any number of threads";
  EXPECT_TRUE(R.isUpperTriangular(0));
  // backward: the entries of the root and of the quotient are at most those of the triangle
  EXPECT_LE((root.lazyProduct(R) - U).norm(), kRounding * (1 + n) * (root.norm() * R.norm() + 1));
  const MatrixXd gram = U.transpose().lazyProduct(U);
  Eigen::Index next = 0;
  numerics::for_each_gram_block(U, 2, [&](Eigen::Index first, const MatrixXd& block) {
    ASSERT_EQ(first, next);
    ASSERT_EQ(block.rows(), first + block.cols());
    next += block.cols();
    for (Eigen::Index j = 0; j < block.cols(); ++j)
      EXPECT_LE((block.col(j) - gram.col(first + j).head(block.rows())).head(first + j + 1).norm(),
                kRounding * (1 + n) * (1 + gram.norm()));
  });
  EXPECT_EQ(next, n);
}

INSTANTIATE_TEST_SUITE_P(Sizes, Dense, testing::Values(0, 1, 2, 127, 128, 129, 300, 700));

TEST(DenseCholesky, a_matrix_that_is_not_positive_is_refused_and_its_lower_half_kept) {
  MatrixXd A(2, 2);
  A << 1, 2, 2, 1;
  EXPECT_FALSE(numerics::upper_cholesky(A));
  EXPECT_EQ(A(1, 0), 2);
}

class OfRank : public testing::TestWithParam<int> {};

TEST_P(OfRank, solutions_are_the_shortest_and_bases_have_as_many_columns) {
  const int rank = GetParam(), m = 9, n = 6;
  const MatrixXd A = numbers(m, rank, 14) * numbers(rank, n, 15), B = numbers(m, 2, 16);
  const MatrixXd inverse = numerics::pseudo_inverse(A);
  // Penrose's four conditions say that it is the pseudoinverse
  EXPECT_LE((A * inverse * A - A).norm(), kRounding * A.norm());
  EXPECT_LE((inverse * A * inverse - inverse).norm(), kRounding * inverse.norm() * inverse.norm() * A.norm());
  EXPECT_LE((A * inverse - (A * inverse).transpose()).norm(), kRounding * inverse.norm() * A.norm());
  EXPECT_LE((inverse * A - (inverse * A).transpose()).norm(), kRounding * inverse.norm() * A.norm());
  EXPECT_LE((numerics::shortest_solution(A, B) - inverse * B).norm(), kRounding * inverse.norm() * inverse.norm() * 10);
  const MatrixXd most = numerics::principal_directions(A, 1e-9);
  for (const MatrixXd& basis : {numerics::orthonormal_basis(A), most}) {
    ASSERT_EQ(basis.cols(), rank);
    EXPECT_LE((basis.transpose() * basis - MatrixXd::Identity(rank, rank)).norm(), kRounding);
    EXPECT_LE((basis * (basis.transpose() * A) - A).norm(), kRounding * A.norm());
  }
  const VectorXd sizes = (most.transpose() * A).rowwise().norm();
  for (int k = 1; k < rank; ++k) EXPECT_LE(sizes[k], sizes[k - 1]);
}

TEST_P(OfRank, symmetric_systems_are_solved_where_they_can_be) {
  const int rank = GetParam(), n = 6;
  const MatrixXd half = numbers(rank, n, 17), A = half.transpose() * half;
  const MatrixXd wanted = A * numbers(n, 3, 18);  // has a solution
  EXPECT_LE((A * numerics::solve_symmetric(A, wanted) - wanted).norm(), 1e-10 * wanted.norm());
  const auto [values, vectors] = numerics::symmetric_eigen(A);
  EXPECT_LE((vectors * values.asDiagonal() * vectors.transpose() - A).norm(), kRounding * A.norm());
  EXPECT_EQ((values.array() > 1e-9 * values[n - 1]).count(), rank);
  if (rank < n) return;
  EXPECT_LE((A * numerics::inverse_symmetric(A) - MatrixXd::Identity(n, n)).norm(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Ranks, OfRank, testing::Values(1, 3, 6));

TEST(DenseEigen, nothing_has_no_eigenvalues) { EXPECT_EQ(numerics::symmetric_eigen(MatrixXd(0, 0)).values.size(), 0); }

}  // namespace
}  // namespace mbtfm
