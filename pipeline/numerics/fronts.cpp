#include "pipeline/numerics/fronts.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "pipeline/numerics/parallel.h"

// Of BLAS and LAPACK, by their Fortran names: no header of theirs is the same everywhere.
extern "C" {
#define MBTFM_BLAS(letter, Real)                                                                              \
  void letter##gemm_(const char*, const char*, const int*, const int*, const int*, const Real*, const Real*,  \
                     const int*, const Real*, const int*, const Real*, Real*, const int*);                    \
  void letter##syrk_(const char*, const char*, const int*, const int*, const Real*, const Real*, const int*,  \
                     const Real*, Real*, const int*);                                                         \
  void letter##trsm_(const char*, const char*, const char*, const char*, const int*, const int*, const Real*, \
                     const Real*, const int*, Real*, const int*);                                             \
  void letter##potrf_(const char*, const int*, Real*, const int*, int*);
MBTFM_BLAS(s, float)
MBTFM_BLAS(d, double)
#undef MBTFM_BLAS
}

namespace mbtfm::numerics {
namespace {

/// BLAS and LAPACK by type.
template <class Real>
struct Blas;
template <>
struct Blas<float> {
  static constexpr auto gemm = sgemm_;
  static constexpr auto syrk = ssyrk_;
  static constexpr auto trsm = strsm_;
  static constexpr auto potrf = spotrf_;
};
template <>
struct Blas<double> {
  static constexpr auto gemm = dgemm_;
  static constexpr auto syrk = dsyrk_;
  static constexpr auto trsm = dtrsm_;
  static constexpr auto potrf = dpotrf_;
};
template <class Real>
constexpr Real kOne = 1;
template <class Real>
constexpr Real kMinus = -1;
template <class Real>
constexpr Real kZero = 0;

// Widths that fill the caches of the BLAS, and leave a dozen tiles of a large front to share among threads
constexpr int kPanelColumns = 192;
constexpr int kTileRows = 384;
// Subtrees of at most this share of the work run side by side: enough of them to balance a handful of threads
constexpr double kSubtreeShare = 1.0 / 32;

/// C -= A B^T
template <class Real>
void subtract_product(int m, int n, int k, const Real* a, int lda, const Real* b, int ldb, Real* c, int ldc) {
  if (m > 0 && n > 0 && k > 0)
    Blas<Real>::gemm("N", "T", &m, &n, &k, &kMinus<Real>, a, &lda, b, &ldb, &kOne<Real>, c, &ldc);
}

int n_tiles(int n, int size) { return (n + size - 1) / size; }

/// One supernode's rows below times themselves: what its elimination takes off the supernodes above.
std::size_t update_size(const Supernodes& s, int k) {
  const std::size_t m = 3 * static_cast<std::size_t>(s.n_rows(k) - s.n_columns(k));
  return m * m;
}

std::size_t panel_size(const Supernodes& s, int k) {
  return 9 * static_cast<std::size_t>(s.n_rows(k)) * s.n_columns(k);
}

double work_of(const Supernodes& s, int k) {
  const double rows = 3.0 * s.n_rows(k), columns = 3.0 * s.n_columns(k);
  return columns * rows * rows;
}

struct Tree {
  std::vector<std::vector<int>> children;
  std::vector<std::vector<int>> subtrees;  ///< supernodes of each that is run whole, by falling work
  std::vector<int> above;                  ///< the others, children first
};

Tree tree_of(const Supernodes& s) {
  const int n = s.count();
  Tree tree;
  tree.children.resize(n);
  std::vector<double> work(n);
  double all = 0;
  for (int k = 0; k < n; ++k) all += work_of(s, k);
  for (int k = 0; k < n; ++k) {  // children come before their parents
    work[k] += work_of(s, k);
    if (s.parent[k] < 0) continue;
    work[s.parent[k]] += work[k];
    tree.children[s.parent[k]].push_back(k);
  }
  std::vector<int> subtree_of(n, -1), roots;
  for (int k = n - 1; k >= 0; --k) {
    const int parent = s.parent[k];
    if (parent >= 0 && subtree_of[parent] >= 0) {
      subtree_of[k] = subtree_of[parent];
    } else if (work[k] <= kSubtreeShare * all) {
      subtree_of[k] = static_cast<int>(roots.size());
      roots.push_back(k);
    }
  }
  std::vector<int> rank(roots.size()), place(roots.size());
  std::iota(rank.begin(), rank.end(), 0);
  std::stable_sort(rank.begin(), rank.end(), [&](int a, int b) { return work[roots[a]] > work[roots[b]]; });
  for (std::size_t r = 0; r < rank.size(); ++r) place[rank[r]] = static_cast<int>(r);
  tree.subtrees.resize(roots.size());
  for (int k = 0; k < n; ++k) {
    (subtree_of[k] < 0 ? tree.above : tree.subtrees[place[subtree_of[k]]]).push_back(k);
  }
  return tree;
}

/// Where the blocks of each column of the factor stand in the matrix.
struct Entries {
  std::vector<std::size_t> start;  ///< by column
  std::vector<int> row;
  std::vector<std::size_t> at;  ///< block of the matrix
  std::vector<char> is_turned;  ///< it stands there transposed
};

Entries entries_of(const BlockMatrix& m, const std::vector<int>& place) {
  Entries e;
  e.start.assign(m.n + 1, 0);
  const auto each = [&](const auto& visit) {
    for (int column = 0; column < m.n; ++column) {
      for (int k = m.start[column]; k < m.start[column + 1]; ++k) visit(place[m.row[k]], place[column], k);
    }
  };
  each([&](int row, int column, int) { ++e.start[std::min(row, column) + 1]; });
  for (int column = 0; column < m.n; ++column) e.start[column + 1] += e.start[column];
  e.row.resize(m.row.size());
  e.at.resize(m.row.size());
  e.is_turned.resize(m.row.size());
  std::vector<std::size_t> next(e.start.begin(), e.start.end() - 1);
  each([&](int row, int column, int k) {
    const std::size_t slot = next[std::min(row, column)]++;
    e.row[slot] = std::max(row, column);
    e.at[slot] = k;
    e.is_turned[slot] = row < column;
  });
  return e;
}

template <class Real>
class Factorisation {
 public:
  Factorisation(const BlockMatrix& matrix, const Supernodes& supernodes, int threads, Panels<Real>& panels)
      : matrix_(matrix),
        s_(supernodes),
        threads_(threads),
        panels_(panels),
        entries_(entries_of(matrix, supernodes.place)),
        tree_(tree_of(supernodes)),
        updates_(supernodes.count()) {}

  bool run() {
    panels_.resize(s_.count());
    parallel_for(static_cast<int>(tree_.subtrees.size()), threads_, [&](int t) {
      for (const int k : tree_.subtrees[t]) eliminate(k, 1);
    });
    for (const int k : tree_.above) eliminate(k, threads_);
    return is_positive_;
  }

 private:
  void eliminate(int k, int threads) {
    if (!is_positive_) return;
    const int rows = 3 * s_.n_rows(k), columns = 3 * s_.n_columns(k), below = rows - columns;
    panels_[k] = std::make_unique_for_overwrite<Real[]>(panel_size(s_, k));
    updates_[k] = std::make_unique_for_overwrite<Real[]>(update_size(s_, k));
    Real* panel = panels_[k].get();
    Real* update = updates_[k].get();
    gather(k, threads);
    if (!factorise_panel(panel, rows, columns, threads)) {
      is_positive_ = false;
      return;
    }
    const Real* lower = panel + columns;
    const int n = n_tiles(below, kTileRows);
    parallel_for(n * (n + 1) / 2, threads, [&](int t) {
      int j = 0;
      for (; t >= n - j; ++j) t -= n - j;  // tiles of the lower triangle, column by column
      const int row = (j + t) * kTileRows, column = j * kTileRows;
      const int m = std::min(kTileRows, below - row), w = std::min(kTileRows, below - column);
      Real* c = update + static_cast<std::size_t>(column) * below + row;
      if (t == 0) {
        Blas<Real>::syrk("L", "N", &m, &columns, &kMinus<Real>, lower + row, &rows, &kOne<Real>, c, &below);
      } else {
        subtract_product(m, w, columns, lower + row, rows, lower + column, rows, c, below);
      }
    });
  }

  /// Blocked Cholesky factorisation of the columns of one front.
  bool factorise_panel(Real* panel, int rows, int columns, int threads) const {
    for (int begin = 0; begin < columns; begin += kPanelColumns) {
      const int width = std::min(kPanelColumns, columns - begin);
      Real* diagonal = panel + static_cast<std::size_t>(begin) * rows + begin;
      const Real* before = panel + begin;  // row `begin` of the columns done
      subtract_product(width, width, begin, before, rows, before, rows, diagonal, rows);
      int info = 0;
      Blas<Real>::potrf("L", &width, diagonal, &rows, &info);
      if (info != 0) return false;
      const int below = rows - begin - width;
      parallel_for(n_tiles(below, kTileRows), threads, [&](int t) {
        const int row = width + t * kTileRows;
        const int m = std::min(kTileRows, below - t * kTileRows);
        subtract_product(m, width, begin, before + row, rows, before, rows, diagonal + row, rows);
        Blas<Real>::trsm("R", "L", "T", "N", &m, &width, &kOne<Real>, diagonal, &rows, diagonal + row, &rows);
      });
    }
    return true;
  }

  /// The front: what the matrix has in these columns, plus the updates of its children.
  void gather(int k, int threads) {
    const int n_columns = s_.n_columns(k), n_rows = s_.n_rows(k), ld = 3 * n_rows, below = 3 * (n_rows - n_columns);
    const int* rows = s_.rows(k);
    Real* panel = panels_[k].get();
    Real* update = updates_[k].get();
    std::vector<std::vector<int>> local;  // by child and row: the row here
    for (const int child : tree_.children[k]) local.push_back(rows_in(k, child));
    // by column, so that each is summed by one thread, in the order of the children
    constexpr int kColumnsATime = 16;
    parallel_for(n_tiles(n_rows, kColumnsATime), threads, [&](int t) {
      for (int j = t * kColumnsATime; j < std::min((t + 1) * kColumnsATime, n_rows); ++j) {
        Real* column = j < n_columns ? panel + 9 * static_cast<std::size_t>(j) * n_rows
                                     : update + 3 * static_cast<std::size_t>(j - n_columns) * below;
        std::fill(column, column + 3 * static_cast<std::size_t>(j < n_columns ? ld : below), Real(0));
        if (j < n_columns) add_matrix(s_.first[k] + j, rows, n_rows, column, ld);
        for (std::size_t c = 0; c < local.size(); ++c) {
          add_child(tree_.children[k][c], local[c], j, n_columns, column, j < n_columns ? ld : below);
        }
      }
    });
    for (const int child : tree_.children[k]) updates_[child].reset();
  }

  std::vector<int> rows_in(int k, int child) const {
    std::vector<int> local;
    const int* here = s_.rows(k);
    const int* row = s_.rows(child);
    for (int i = s_.n_columns(child), at = 0; i < s_.n_rows(child); ++i) {
      while (here[at] != row[i]) ++at;  // both rise, and a child's rows below are among its parent's
      local.push_back(at);
    }
    return local;
  }

  void add_matrix(int column_here, const int* rows, int n_rows, Real* column, int ld) const {
    for (std::size_t e = entries_.start[column_here]; e < entries_.start[column_here + 1]; ++e) {
      const auto at = 3 * (std::lower_bound(rows, rows + n_rows, entries_.row[e]) - rows);
      const double* block = &matrix_.value[9 * entries_.at[e]];
      for (int p = 0; p < 3; ++p) {
        for (int q = 0; q < 3; ++q) {
          column[q * ld + at + p] += static_cast<Real>(entries_.is_turned[e] ? block[3 * q + p] : block[3 * p + q]);
        }
      }
    }
  }

  /// Add the child's columns that stand for column j here, if any.
  void add_child(int child, const std::vector<int>& local, int j, int n_columns, Real* column, int ld) const {
    const auto found = std::lower_bound(local.begin(), local.end(), j);
    if (found == local.end() || *found != j) return;
    const int first = static_cast<int>(found - local.begin());
    const int n = static_cast<int>(local.size());
    const int offset = j < n_columns ? 0 : n_columns;  // an update has no rows of the columns themselves
    for (int q = 0; q < 3; ++q) {
      const Real* from = updates_[child].get() + (3 * static_cast<std::size_t>(first) + q) * 3 * n;
      Real* to = column + static_cast<std::size_t>(q) * ld;
      for (int i = first; i < n; ++i) {
        Real* at = to + 3 * (local[i] - offset);
        at[0] += from[3 * i];  // above the diagonal of a first block: never read
        at[1] += from[3 * i + 1];
        at[2] += from[3 * i + 2];
      }
    }
  }

  const BlockMatrix& matrix_;
  const Supernodes& s_;
  int threads_;
  Panels<Real>& panels_;
  Entries entries_;
  Tree tree_;
  std::vector<std::unique_ptr<Real[]>> updates_;
  std::atomic<bool> is_positive_ = true;
};

}  // namespace

double most_numbers(const Supernodes& s) {
  // of the tree walked children first; side by side, each subtree has its own stack: that of the largest for each
  const Tree tree = tree_of(s);
  double factor = 0, stack = 0, most = 0;
  const auto visit = [&](int k) {
    stack += static_cast<double>(update_size(s, k));
    most = std::max(most, stack);
    for (const int child : tree.children[k]) stack -= static_cast<double>(update_size(s, child));
  };
  for (const auto& subtree : tree.subtrees) {
    for (const int k : subtree) visit(k);
  }
  for (const int k : tree.above) visit(k);
  for (int k = 0; k < s.count(); ++k) factor += static_cast<double>(panel_size(s, k));
  return factor + most;
}

template <class Real>
bool factorise(const BlockMatrix& matrix, const Supernodes& supernodes, int threads, Panels<Real>& panels) {
  return Factorisation<Real>(matrix, supernodes, threads, panels).run();
}

template <class Real>
void solve_panels(const Supernodes& s, const Panels<Real>& panels, const std::vector<char>& is_needed, int k, Real* b) {
  std::vector<Real> below;  // k rows, as b
  std::vector<char> is_active(s.count(), 0);
  const auto gathered = [&](int node, int n_columns) {
    const int n = s.n_rows(node) - n_columns;
    below.resize(3 * static_cast<std::size_t>(n) * k);
    return n;
  };
  const auto row_of = [&](int node, int i) { return b + 3 * static_cast<std::size_t>(s.rows(node)[i]) * k; };
  for (int node = 0; node < s.count(); ++node) {
    const int n_columns = s.n_columns(node), columns = 3 * n_columns, ld = 3 * s.n_rows(node);
    Real* own = b + 3 * static_cast<std::size_t>(s.first[node]) * k;
    const auto is_zero = [](Real x) { return x == 0; };
    if (!is_active[node] && std::all_of(own, own + static_cast<std::size_t>(columns) * k, is_zero)) continue;
    if (s.parent[node] >= 0) is_active[s.parent[node]] = 1;
    const Real* panel = panels[node].get();
    Blas<Real>::trsm("R", "L", "T", "N", &k, &columns, &kOne<Real>, panel, &ld, own, &k);
    const int n = gathered(node, n_columns), m = 3 * n;
    if (n == 0) continue;
    Blas<Real>::gemm("N", "T", &k, &m, &columns, &kOne<Real>, own, &k, panel + columns, &ld, &kZero<Real>, below.data(),
                     &k);
    for (int i = 0; i < n; ++i) {
      Real* to = row_of(node, n_columns + i);
      const Real* from = &below[3 * static_cast<std::size_t>(i) * k];
      for (int q = 0; q < 3 * k; ++q) to[q] -= from[q];
    }
  }
  for (int node = s.count() - 1; node >= 0; --node) {
    if (!is_needed[node]) continue;
    const int n_columns = s.n_columns(node), columns = 3 * n_columns, ld = 3 * s.n_rows(node);
    Real* own = b + 3 * static_cast<std::size_t>(s.first[node]) * k;
    const Real* panel = panels[node].get();
    const int n = gathered(node, n_columns), m = 3 * n;
    for (int i = 0; i < n; ++i) {
      const Real* from = row_of(node, n_columns + i);
      std::copy(from, from + 3 * k, &below[3 * static_cast<std::size_t>(i) * k]);
    }
    if (n > 0) {
      Blas<Real>::gemm("N", "N", &k, &columns, &m, &kMinus<Real>, below.data(), &k, panel + columns, &ld, &kOne<Real>,
                       own, &k);
    }
    Blas<Real>::trsm("R", "L", "N", "N", &k, &columns, &kOne<Real>, panel, &ld, own, &k);
  }
}

template bool factorise(const BlockMatrix&, const Supernodes&, int, Panels<float>&);
template bool factorise(const BlockMatrix&, const Supernodes&, int, Panels<double>&);
template void solve_panels(const Supernodes&, const Panels<float>&, const std::vector<char>&, int, float*);
template void solve_panels(const Supernodes&, const Panels<double>&, const std::vector<char>&, int, double*);

}  // namespace mbtfm::numerics
