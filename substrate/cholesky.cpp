#include "substrate/cholesky.h"

#include <cholmod.h>
#include <dlfcn.h>

#include <algorithm>
#include <cstdio>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"

namespace mbtfm::substrate {

namespace {

/// CHOLMOD's settings and scratch: one for each thread.
struct Common {
  cholmod_common c;
  Common() {
    cholmod_start(&c);
    c.print = 0;
    c.supernodal = CHOLMOD_SUPERNODAL;
  }
  ~Common() { cholmod_finish(&c); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;
};

/// OpenBLAS' own threads, where the BLAS is OpenBLAS: it pays in the factorisation, and harms in concurrent solves.
void set_blas_threads(int threads) {
  static const auto set = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  if (set) set(threads);
}

/// Pattern of the block matrix as a sparse matrix of CHOLMOD that owns nothing.
cholmod_sparse pattern_of(const BlockMatrix& m) {
  cholmod_sparse a{};
  a.nrow = a.ncol = m.n;
  a.nzmax = m.row.size();
  a.p = const_cast<int*>(m.start.data());
  a.i = const_cast<int*>(m.row.data());
  a.stype = -1;
  a.itype = CHOLMOD_INT;
  a.xtype = CHOLMOD_PATTERN;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = a.packed = 1;
  return a;
}

cholmod_sparse* expand(const BlockMatrix& m, cholmod_common& c) {
  const std::size_t entries = 9 * m.row.size() - 3 * static_cast<std::size_t>(m.n);  // diagonal blocks have 6
  cholmod_sparse* a = cholmod_allocate_sparse(3 * m.n, 3 * m.n, entries, 1, 1, -1, CHOLMOD_REAL, &c);
  if (!a) return nullptr;
  int* start = static_cast<int*>(a->p);
  int* row = static_cast<int*>(a->i);
  double* value = static_cast<double*>(a->x);
  int next = 0;
  for (int column = 0; column < m.n; ++column) {
    for (int q = 0; q < 3; ++q) {
      start[3 * column + q] = next;
      for (int k = m.start[column]; k < m.start[column + 1]; ++k) {
        for (int p = m.row[k] == column ? q : 0; p < 3; ++p) {
          row[next] = 3 * m.row[k] + p;
          value[next++] = m.value[9 * static_cast<std::size_t>(k) + 3 * p + q];
        }
      }
    }
  }
  start[3 * m.n] = next;
  return a;
}

std::string shown_GB(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g GB", value);
  return text;
}

// 16 columns: the fastest measured width of a block; wider ones leave the cache
constexpr int kBlockColumns = 16;

}  // namespace

struct SparseCholesky::Impl {
  Common common;
  cholmod_factor* factor = nullptr;
  int n = 0;
  int threads = 1;
  ~Impl() { cholmod_free_factor(&factor, &common.c); }
};

SparseCholesky::SparseCholesky(const BlockMatrix& matrix, int threads, int blas_threads, double memory_limit_GB)
    : impl_(std::make_unique<Impl>()) {
  cholmod_common& c = impl_->common.c;
  impl_->n = 3 * matrix.n;
  impl_->threads = threads;
  // order the nodes, not the unknowns: a third of the graph, the same fill
  std::vector<int> node_order(matrix.n), order(3 * matrix.n);
  cholmod_sparse pattern = pattern_of(matrix);
  if (!cholmod_metis(&pattern, nullptr, 0, 1, node_order.data(), &c)) throw InternalError("cholmod_metis failed");
  for (int k = 0; k < 3 * matrix.n; ++k) order[k] = 3 * node_order[k / 3] + k % 3;

  cholmod_sparse* a = expand(matrix, c);
  if (!a) throw NotSolved(Report{.reason = "out of memory for the stiffness matrix of the substrate"});
  c.nmethods = 1;
  c.method[0].ordering = CHOLMOD_GIVEN;
  impl_->factor = cholmod_analyze_p(a, order.data(), nullptr, 0, &c);
  if (!impl_->factor) {
    cholmod_free_sparse(&a, &c);
    throw NotSolved(Report{.reason = "the substrate's equations could not be analysed: out of memory"});
  }
  const double needed_GB = factor_GB() + 24e-9 * static_cast<double>(a->nzmax);  // and the matrix, twice while copied
  if (needed_GB > memory_limit_GB) {
    cholmod_free_sparse(&a, &c);
    throw NotSolved(Report{.reason = "the substrate's " + std::to_string(impl_->n) + " unknowns take " +
                                     shown_GB(needed_GB) + " of memory, allowed are " + shown_GB(memory_limit_GB) +
                                     ": allow more (memory_limit_GB), ask for a coarser mesh, or take the model "
                                     "'layer'"});
  }
  set_blas_threads(blas_threads);
  cholmod_factorize(a, impl_->factor, &c);
  set_blas_threads(1);
  cholmod_free_sparse(&a, &c);
  if (c.status != CHOLMOD_OK) {
    throw NotSolved(Report{.reason = c.status == CHOLMOD_NOT_POSDEF
                                         ? "the substrate's stiffness matrix is not positive definite to rounding: "
                                           "the Poisson ratio is too near 1/2"
                                         : "the substrate's factorisation failed: out of memory"});
  }
}

SparseCholesky::~SparseCholesky() = default;

double SparseCholesky::factor_GB() const { return 8e-9 * static_cast<double>(impl_->factor->xsize); }

void SparseCholesky::solve(int n_columns, const std::function<void(int, double*)>& fill,
                           const std::function<void(int, const double*)>& take) const {
  const std::size_t n = impl_->n;
  const int n_blocks = (n_columns + kBlockColumns - 1) / kBlockColumns;
  parallel_for(n_blocks, impl_->threads, [&](int block) {
    const int first = block * kBlockColumns;
    const int columns = std::min(kBlockColumns, n_columns - first);
    Common common;
    std::vector<double> b(n * columns, 0.0);
    for (int k = 0; k < columns; ++k) fill(first + k, &b[k * n]);
    cholmod_dense rhs{};
    rhs.nrow = rhs.d = n;
    rhs.ncol = columns;
    rhs.nzmax = b.size();
    rhs.x = b.data();
    rhs.xtype = CHOLMOD_REAL;
    rhs.dtype = CHOLMOD_DOUBLE;
    cholmod_dense *x = nullptr, *y = nullptr, *e = nullptr;
    const bool is_solved = cholmod_solve2(CHOLMOD_A, impl_->factor, &rhs, nullptr, &x, nullptr, &y, &e, &common.c);
    if (is_solved) {
      for (int k = 0; k < columns; ++k) take(first + k, static_cast<const double*>(x->x) + k * n);
    }
    cholmod_free_dense(&x, &common.c);
    cholmod_free_dense(&y, &common.c);
    cholmod_free_dense(&e, &common.c);
    if (!is_solved) throw NotSolved(Report{.reason = "out of memory while solving for the substrate"});
  });
}

}  // namespace mbtfm::substrate
