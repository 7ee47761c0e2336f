#include "pipeline/numerics/dense.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/numerics/triangle.h"

extern "C" {
void dgemm_(const char* transpose_a, const char* transpose_b, const int* m, const int* n, const int* k,
            const double* alpha, const double* a, const int* lda, const double* b, const int* ldb, const double* beta,
            double* c, const int* ldc);
void dsyrk_(const char* triangle, const char* transpose, const int* n, const int* k, const double* alpha,
            const double* a, const int* lda, const double* beta, double* c, const int* ldc);
void dtrsm_(const char* side, const char* triangle, const char* transpose, const char* diagonal, const int* m,
            const int* n, const double* alpha, const double* a, const int* lda, double* b, const int* ldb);
void dtrmm_(const char* side, const char* triangle, const char* transpose, const char* diagonal, const int* m,
            const int* n, const double* alpha, const double* a, const int* lda, double* b, const int* ldb);
void dsyevd_(const char* vectors, const char* triangle, const int* n, double* a, const int* lda, double* values,
             double* work, const int* n_work, int* integers, const int* n_integers, int* info);
void dgesdd_(const char* vectors, const int* m, const int* n, double* a, const int* lda, double* values, double* u,
             const int* ldu, double* vt, const int* ldvt, double* work, const int* n_work, int* integers, int* info);
void dpotrf_(const char* triangle, const int* n, double* a, const int* lda, int* info);
}

namespace mbtfm::numerics {

namespace {

constexpr double kOne = 1, kLess = -1, kZero = 0;
constexpr int kStrip = 128;  // columns or rows that one thread takes at a time: enough for BLAS' own blocks
constexpr int kPanel = 512;  // that are eliminated, or solved for, at once

/// body(begin, count) over strips of columns or rows.
template <class Body>
void over_strips(Index n_columns, int threads, const Body& body) {
  const int n = static_cast<int>(n_columns);
  parallel_for((n + kStrip - 1) / kStrip, threads, [&](int s) { body(s * kStrip, std::min(kStrip, n - s * kStrip)); });
}

MatrixXd general_product(char transpose_a, const MatrixXd& A, const MatrixXd& B, int threads) {
  const bool is_transposed = transpose_a == 'T';
  const int m = static_cast<int>(is_transposed ? A.cols() : A.rows());
  const int k = static_cast<int>(is_transposed ? A.rows() : A.cols());
  MBTFM_ASSERT(B.rows() == k);
  if (m == 0 || k == 0 || B.cols() == 0) return MatrixXd::Zero(m, B.cols());
  MatrixXd C(m, B.cols());
  const int lda = static_cast<int>(A.rows());
  over_strips(B.cols(), threads, [&](int begin, int count) {
    dgemm_(&transpose_a, "N", &m, &count, &k, &kOne, A.data(), &lda, B.col(begin).data(), &k, &kZero,
           C.col(begin).data(), &m);
  });
  return C;
}

/// dtrsm or dtrmm.
using TriangleRoutine = decltype(dtrsm_);

void with_triangle(TriangleRoutine routine, char transpose, const MatrixXd& U, MatrixXd& B, int threads) {
  const int n = static_cast<int>(U.rows());
  MBTFM_ASSERT(B.rows() == n && U.cols() == n);
  if (B.size() == 0) return;
  over_strips(B.cols(), threads, [&](int begin, int count) {
    routine("L", "U", &transpose, "N", &n, &count, &kOne, U.data(), &n, B.col(begin).data(), &n);
  });
}

}  // namespace

MatrixXd product(const MatrixXd& A, const MatrixXd& B, int threads) { return general_product('N', A, B, threads); }

MatrixXd transposed_product(const MatrixXd& A, const MatrixXd& B, int threads) {
  return general_product('T', A, B, threads);
}

void add_upper_gram(const MatrixXd& A, MatrixXd& square, int threads, double factor) {
  const int n = static_cast<int>(A.cols()), k = static_cast<int>(A.rows());
  MBTFM_ASSERT(square.rows() == n && square.cols() == n);
  if (n == 0 || k == 0) return;
  over_strips(n, threads, [&](int begin, int count) {
    const double* strip = A.col(begin).data();
    if (begin > 0) {
      dgemm_("T", "N", &begin, &count, &k, &factor, A.data(), &k, strip, &k, &kOne, square.col(begin).data(), &n);
    }
    dsyrk_("U", "T", &count, &k, &factor, strip, &k, &kOne, &square(begin, begin), &n);
  });
}

void add_upper_outer(const MatrixXd& A, MatrixXd& square, int threads) {
  const int n = static_cast<int>(A.rows()), k = static_cast<int>(A.cols());
  MBTFM_ASSERT(square.rows() == n && square.cols() == n);
  if (n == 0 || k == 0) return;
  over_strips(n, threads, [&](int begin, int count) {
    const double* strip = A.data() + begin;
    if (begin > 0) {
      dgemm_("N", "T", &begin, &count, &k, &kOne, A.data(), &n, strip, &n, &kOne, square.col(begin).data(), &n);
    }
    dsyrk_("U", "N", &count, &k, &kOne, strip, &n, &kOne, &square(begin, begin), &n);
  });
}

void mirror_upper(MatrixXd& square) {
  for (Index j = 0; j < square.cols(); ++j)
    for (Index i = j + 1; i < square.rows(); ++i) square(i, j) = square(j, i);
}

void mirror_lower(MatrixXd& square) {
  for (Index j = 0; j < square.cols(); ++j)
    for (Index i = j + 1; i < square.rows(); ++i) square(j, i) = square(i, j);
}

void clear_below_diagonal(MatrixXd& square) { square.triangularView<Eigen::StrictlyLower>().setZero(); }

MatrixXd gram(const MatrixXd& A, int threads) {
  MatrixXd square = MatrixXd::Zero(A.cols(), A.cols());
  add_upper_gram(A, square, threads);
  mirror_upper(square);
  return square;
}

bool upper_cholesky(MatrixXd& A, int threads) {
  const int n = static_cast<int>(A.rows());
  for (int first = 0; first < n; first += kPanel) {
    const int rows = std::min(kPanel, n - first), next = first + rows;
    int info = 0;
    dpotrf_("U", &rows, &A(first, first), &n, &info);
    if (info != 0) return false;
    over_strips(n - next, threads, [&](int begin, int count) {
      dtrsm_("L", "U", "T", "N", &rows, &count, &kOne, &A(first, first), &n, &A(first, next + begin), &n);
    });
    over_strips(n - next, threads, [&](int begin, int count) {
      const double *panel = &A(first, next), *strip = &A(first, next + begin);
      if (begin > 0)
        dgemm_("T", "N", &begin, &count, &rows, &kLess, panel, &n, strip, &n, &kOne, &A(next, next + begin), &n);
      dsyrk_("U", "T", &count, &rows, &kLess, strip, &n, &kOne, &A(next + begin, next + begin), &n);
    });
  }
  return true;
}

bool downdate_upper(MatrixXd& U, MatrixXd B) {
  std::vector<double> cosine(static_cast<std::size_t>(U.rows())), sine(cosine.size());
  for (Index b = 0; b < B.rows(); ++b) {
    // column by column, which takes the rotations of all rows above
    for (Index j = 0; j < U.cols(); ++j) {
      double* column = U.col(j).data();
      double x = B(b, j);
      for (Index k = 0; k < j; ++k) {
        column[k] = (column[k] - sine[k] * x) / cosine[k];
        x = cosine[k] * x - sine[k] * column[k];
      }
      const double rest = (column[j] - x) * (column[j] + x);
      if (!(rest > 0)) return false;
      cosine[j] = std::sqrt(rest) / column[j];
      sine[j] = x / column[j];
      column[j] = std::sqrt(rest);
    }
  }
  return true;
}

void multiply_upper(const MatrixXd& U, MatrixXd& B, int threads) { with_triangle(dtrmm_, 'N', U, B, threads); }
void solve_upper(const MatrixXd& U, MatrixXd& B, int threads) { with_triangle(dtrsm_, 'N', U, B, threads); }
void solve_upper_transposed(const MatrixXd& U, MatrixXd& B, int threads) { with_triangle(dtrsm_, 'T', U, B, threads); }

SymmetricEigen symmetric_eigen(MatrixXd A) {
  const int n = static_cast<int>(A.rows());
  SymmetricEigen eigen{VectorXd(n), {}};
  if (n == 0) return eigen;
  int info = 0, n_integers = -1, n_work = -1, integers_wanted = 0;
  double work_wanted = 0;
  dsyevd_("V", "U", &n, A.data(), &n, eigen.values.data(), &work_wanted, &n_work, &integers_wanted, &n_integers, &info);
  n_work = static_cast<int>(work_wanted);
  n_integers = integers_wanted;
  std::vector<double> work(static_cast<std::size_t>(n_work));
  std::vector<int> integers(static_cast<std::size_t>(n_integers));
  dsyevd_("V", "U", &n, A.data(), &n, eigen.values.data(), work.data(), &n_work, integers.data(), &n_integers, &info);
  MBTFM_ASSERT(info == 0);
  eigen.vectors = std::move(A);
  return eigen;
}

VectorXd matvec(const MatrixView& A, const VectorView& x) { return A * x; }
VectorXd transposed_matvec(const MatrixView& A, const VectorView& x) { return A.transpose() * x; }
VectorXd plus_matvec(const VectorView& c, const MatrixView& A, const VectorView& x) { return c + A * x; }
VectorXd minus_matvec(const VectorView& c, const MatrixView& A, const VectorView& x) { return c - A * x; }
double quadratic_form(const MatrixView& S, const VectorView& x) { return x.dot(S * x); }
VectorXd quadratic_forms(const MatrixXd& S, const MatrixXd& X) {
  return X.cwiseProduct(S * X).colwise().sum().transpose();
}

MatrixXd small_product(const MatrixView& A, const MatrixView& B) { return A * B; }
MatrixXd small_transposed_product(const MatrixView& A, const MatrixView& B) { return A.transpose() * B; }
MatrixXd small_product(double factor, const MatrixView& A, const MatrixView& B) { return factor * A * B; }
MatrixXd plus_product(const MatrixView& C, const MatrixView& A, const MatrixView& B) { return C + A * B; }
MatrixXd minus_product(const MatrixView& C, const MatrixView& A, const MatrixView& B) { return C - A * B; }
MatrixXd congruence(const MatrixView& A, const MatrixView& S) {
  return small_product(small_product(A, S), A.transpose());
}
MatrixXd weighted_outer(const MatrixView& A, const VectorView& w) {
  return small_product(A * w.asDiagonal(), A.transpose());
}
MatrixXd scaled_on_both_sides(const MatrixView& S, const VectorView& d) { return d.asDiagonal() * S * d.asDiagonal(); }

SmallCholesky::SmallCholesky(const MatrixView& A) : llt_(std::make_shared<const Eigen::LLT<MatrixXd>>(A)) {}
bool SmallCholesky::is_definite() const { return llt_->info() == Eigen::Success; }
VectorXd SmallCholesky::solve(const VectorView& b) const { return llt_->solve(b); }
MatrixXd SmallCholesky::solve_matrix(const MatrixView& B) const { return llt_->solve(B); }
MatrixXd SmallCholesky::inverse() const { return llt_->solve(MatrixXd::Identity(llt_->rows(), llt_->cols())); }
VectorXd SmallCholesky::multiply(const VectorView& x) const { return llt_->matrixL() * (llt_->matrixU() * x); }
double SmallCholesky::log_determinant() const { return 2 * llt_->matrixLLT().diagonal().array().log().sum(); }
MatrixXd SmallCholesky::solve_lower(const MatrixView& B) const { return llt_->matrixL().solve(B); }
MatrixXd SmallCholesky::upper() const { return llt_->matrixU(); }

MatrixXd inverse(const MatrixView& A) { return A.inverse(); }

MatrixXd inverse_root(const MatrixView& A, double least) {
  const auto [values, vectors] = symmetric_eigen(A);
  return vectors * values.cwiseMax(least).cwiseSqrt().cwiseInverse().asDiagonal() * vectors.transpose();
}

MatrixXd across(const VectorView& vector) {
  const MatrixXd basis = vector.householderQr().householderQ();
  return basis.rightCols(vector.size() - 1);
}

MatrixXd solve_symmetric(const MatrixXd& A, const MatrixXd& B) { return A.ldlt().solve(B); }
MatrixXd inverse_symmetric(const MatrixXd& A) { return solve_symmetric(A, MatrixXd::Identity(A.rows(), A.cols())); }

MatrixXd shortest_solution(const MatrixXd& A, const MatrixXd& B) {
  return A.completeOrthogonalDecomposition().solve(B);
}
MatrixXd pseudo_inverse(const MatrixXd& A) { return A.completeOrthogonalDecomposition().pseudoInverse(); }

MatrixXd orthonormal_basis(const MatrixXd& A) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  return qr.householderQ() * MatrixXd::Identity(A.rows(), qr.rank());
}

MatrixXd principal_directions(MatrixXd A, double least_part) {
  const int m = static_cast<int>(A.rows()), n = static_cast<int>(A.cols()), k = std::min(m, n);
  MatrixXd left(m, k), right(k, n);
  VectorXd sizes(k);
  std::vector<int> integers(static_cast<std::size_t>(8 * k));
  int info = 0, n_work = -1;
  double work_wanted = 0;
  dgesdd_("S", &m, &n, A.data(), &m, sizes.data(), left.data(), &m, right.data(), &k, &work_wanted, &n_work,
          integers.data(), &info);
  n_work = static_cast<int>(work_wanted);
  std::vector<double> work(static_cast<std::size_t>(n_work));
  dgesdd_("S", &m, &n, A.data(), &m, sizes.data(), left.data(), &m, right.data(), &k, work.data(), &n_work,
          integers.data(), &info);
  MBTFM_ASSERT(info == 0);
  return left.leftCols((sizes.array() > least_part * sizes[0]).count());
}

// Of upper triangles (triangle.h).

namespace {

/// R of a small A = R Rᵀ: Cholesky's lower factor of A with rows and columns in the other order.
bool root_of_panel(MatrixXd& A, int first, int size) {
  MatrixXd turned = A.block(first, first, size, size).reverse();
  int info = 0;
  dpotrf_("L", &size, turned.data(), &size, &info);
  if (info != 0) return false;
  A.block(first, first, size, size) = MatrixXd(turned.triangularView<Eigen::Lower>()).reverse();
  return true;
}

}  // namespace

void add_triangle_outer(const MatrixXd& U, const VectorXd& weight, MatrixXd& square, int threads) {
  const int n = static_cast<int>(U.rows());
  MBTFM_ASSERT(U.cols() == n && weight.size() == n && square.rows() == n && square.cols() == n);
  over_strips(n, threads, [&](int first, int count) {
    const int rows = first + count, depth = n - first;  // rows of a strip have nothing to the left of it
    const MatrixXd strip = U.block(first, first, count, depth) * weight.tail(depth).asDiagonal();
    dgemm_("N", "T", &rows, &count, &depth, &kOne, U.col(first).data(), &n, strip.data(), &count, &kOne,
           square.col(first).data(), &n);
  });
}

bool upper_root(MatrixXd& A, int threads) {
  const int n = static_cast<int>(A.rows());
  MBTFM_ASSERT(A.cols() == n);
  for (int first = (n - 1) / kPanel * kPanel; first >= 0 && n > 0; first -= kPanel) {
    const int size = std::min(kPanel, n - first);
    if (!root_of_panel(A, first, size)) return false;
    over_strips(first, threads, [&](int begin, int rows) {
      dtrsm_("R", "U", "T", "N", &rows, &size, &kOne, &A(first, first), &n, &A(begin, first), &n);
    });
    over_strips(first, threads, [&](int begin, int count) {
      const int rows = begin + count;
      dgemm_("N", "T", &rows, &count, &size, &kLess, A.col(first).data(), &n, &A(begin, first), &n, &kOne,
             A.col(begin).data(), &n);
    });
  }
  return true;
}

void divide_into(const MatrixXd& U, MatrixXd& R, int threads) {
  const int n = static_cast<int>(U.rows());
  MBTFM_ASSERT(U.cols() == n && R.rows() == n && R.cols() == n);
  // the last columns first: those before need no more of R than is left
  for (int first = (n - 1) / kPanel * kPanel; first >= 0 && n > 0; first -= kPanel) {
    const int size = std::min(kPanel, n - first), rows = first + size;
    MatrixXd panel(rows, size);
    panel.topRows(first) = U.block(0, first, first, size);
    panel.bottomRows(size) = MatrixXd(U.block(first, first, size, size).triangularView<Eigen::Upper>());
    over_strips(size, threads, [&](int begin, int count) {
      dtrsm_("L", "U", "N", "N", &rows, &count, &kOne, R.data(), &n, panel.col(begin).data(), &rows);
    });
    R.block(0, first, rows, size) = panel;
    R.block(rows, first, n - rows, size).setZero();
  }
}

void for_each_gram_block(const MatrixXd& U, int threads, const std::function<void(Index, const MatrixXd&)>& body) {
  const int n = static_cast<int>(U.rows());
  MBTFM_ASSERT(U.cols() == n);
  constexpr int kWhole = kPanel - kPanel % 6;  // forces, of two or three components
  for (int first = 0; first < n; first += kWhole) {
    const int size = std::min(kWhole, n - first), rows = first + size;
    MatrixXd block(rows, size);
    over_strips(rows, threads, [&](int begin, int count) {
      const int depth = begin + count;  // of these columns
      dgemm_("T", "N", &count, &size, &depth, &kOne, U.col(begin).data(), &n, U.col(first).data(), &n, &kZero,
             &block(begin, 0), &rows);
    });
    body(first, block);
  }
}

}  // namespace mbtfm::numerics
