#include "pipeline/numerics/triangle.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/parallel.h"

extern "C" {
void dgemm_(const char* transpose_a, const char* transpose_b, const int* m, const int* n, const int* k,
            const double* alpha, const double* a, const int* lda, const double* b, const int* ldb, const double* beta,
            double* c, const int* ldc);
void dtrsm_(const char* side, const char* triangle, const char* transpose, const char* diagonal, const int* m,
            const int* n, const double* alpha, const double* a, const int* lda, double* b, const int* ldb);
void dpotrf_(const char* triangle, const int* n, double* a, const int* lda, int* info);
}

namespace mbtfm::numerics {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kOne = 1, kLess = -1, kZero = 0;
constexpr int kStrip = 128;  // columns or rows that one thread takes at a time: enough for BLAS' own blocks
constexpr int kPanel = 512;  // that are eliminated, or solved for, at once

int n_strips(int n) { return (n + kStrip - 1) / kStrip; }
int size_of_strip(int s, int n) { return std::min(kStrip, n - s * kStrip); }

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

void add_triangle_outer(const MatrixXd& U, const Eigen::VectorXd& weight, MatrixXd& square, int threads) {
  const int n = static_cast<int>(U.rows());
  MBTFM_ASSERT(U.cols() == n && weight.size() == n && square.rows() == n && square.cols() == n);
  parallel_for(n_strips(n), threads, [&](int s) {
    const int first = s * kStrip, count = size_of_strip(s, n), rows = first + count, depth = n - first;
    // rows of a strip have nothing to the left of it
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
    parallel_for(n_strips(first), threads, [&](int s) {
      const int rows = size_of_strip(s, first);
      dtrsm_("R", "U", "T", "N", &rows, &size, &kOne, &A(first, first), &n, &A(s * kStrip, first), &n);
    });
    parallel_for(n_strips(first), threads, [&](int s) {
      const int begin = s * kStrip, count = size_of_strip(s, first), rows = begin + count;
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
    parallel_for(n_strips(size), threads, [&](int s) {
      const int count = size_of_strip(s, size);
      dtrsm_("L", "U", "N", "N", &rows, &count, &kOne, R.data(), &n, panel.col(s * kStrip).data(), &rows);
    });
    R.block(0, first, rows, size) = panel;
    R.block(rows, first, n - rows, size).setZero();
  }
}

void for_each_gram_block(const MatrixXd& U, int threads, const std::function<void(Index, const MatrixXd&)>& body) {
  const int n = static_cast<int>(U.rows());
  MBTFM_ASSERT(U.cols() == n);
  for (int first = 0; first < n; first += kPanel) {
    const int size = std::min(kPanel, n - first), rows = first + size;
    MatrixXd block(rows, size);
    parallel_for(n_strips(rows), threads, [&](int s) {
      const int begin = s * kStrip, count = size_of_strip(s, rows), depth = begin + count;  // of these columns
      dgemm_("T", "N", &count, &size, &depth, &kOne, U.col(begin).data(), &n, U.col(first).data(), &n, &kZero,
             &block(begin, 0), &rows);
    });
    body(first, block);
  }
}

}  // namespace mbtfm::numerics
