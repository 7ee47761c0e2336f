#include "pipeline/numerics/cholesky.h"

#include <cholmod.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <variant>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/blas.h"
#include "pipeline/numerics/factor_file.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::numerics {

namespace {

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

Supernodes supernodes_of(const cholmod_factor& factor) {
  const auto copy = [](const void* from, std::size_t n) {
    return std::vector<int>(static_cast<const int*>(from), static_cast<const int*>(from) + n);
  };
  Supernodes s;
  s.first = copy(factor.super, factor.nsuper + 1);
  s.row_start = copy(factor.pi, factor.nsuper + 1);
  s.row = copy(factor.s, factor.ssize);
  s.place.resize(factor.n);
  for (std::size_t column = 0; column < factor.n; ++column) {
    s.place[static_cast<const int*>(factor.Perm)[column]] = static_cast<int>(column);
  }
  std::vector<int> supernode_of(factor.n);
  for (std::size_t k = 0; k < factor.nsuper; ++k) {
    for (int column = s.first[k]; column < s.first[k + 1]; ++column) supernode_of[column] = static_cast<int>(k);
  }
  for (std::size_t k = 0; k < factor.nsuper; ++k) {
    const int below = s.row_start[k] + s.first[k + 1] - s.first[k];
    s.parent.push_back(below < s.row_start[k + 1] ? supernode_of[s.row[below]] : -1);
  }
  return s;
}

/// Order and group the nodes, not the unknowns: a ninth of the graph, the same fill.
Supernodes analyse(const BlockMatrix& matrix) {
  cholmod_common c;
  cholmod_start(&c);
  c.print = 0;
  c.supernodal = CHOLMOD_SUPERNODAL;
  c.nmethods = 1;
  c.method[0].ordering = CHOLMOD_GIVEN;
  cholmod_sparse pattern = pattern_of(matrix);
  std::vector<int> order(matrix.n);
  cholmod_factor* factor = nullptr;
  // METIS draws from the C library's one generator, which it seeds: two at a time would order at random
  static std::mutex one_at_a_time;
  const bool is_ordered = [&] {
    const std::lock_guard lock(one_at_a_time);
    return cholmod_metis(&pattern, nullptr, 0, 1, order.data(), &c) != 0;
  }();
  if (is_ordered) {
    factor = cholmod_analyze_p(&pattern, order.data(), nullptr, 0, &c);
  }
  Supernodes supernodes;
  if (factor && factor->is_super) supernodes = supernodes_of(*factor);
  cholmod_free_factor(&factor, &c);
  cholmod_finish(&c);
  if (supernodes.first.empty()) {
    throw OutOfMemory("the substrate's equations could not be ordered: out of memory");
  }
  return supernodes;
}

std::string shown_GB(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g GB", value);
  return text;
}

// columns solved at a time: wide enough for the BLAS, few enough that a block of 300 000 unknowns stays
// below 250 MB
constexpr int kBlockColumns = 96;

/// Factorise, or say why not.
template <class Real>
Panels<Real> factor_of(const BlockMatrix& matrix, const Supernodes& s, const FactorOptions& options) {
  const double memory_limit_GB = options.memory_limit_GB;
  const double needed_GB =
      1e-9 * sizeof(Real) * most_numbers(s) +
      8e-9 * (static_cast<double>(matrix.value.size()) + 3.0 * matrix.n * kBlockColumns * options.threads);
  if (needed_GB > memory_limit_GB) {
    // a factor grows at most as the power 4/3 of the unknowns (nested dissection of a cube)
    const auto fitting = static_cast<std::int64_t>(3 * matrix.n * std::pow(memory_limit_GB / needed_GB, 0.75));
    throw OutOfMemory("the substrate's " + std::to_string(3 * matrix.n) + " unknowns take " + shown_GB(needed_GB) +
                      " of memory, allowed are " + shown_GB(memory_limit_GB) + ", which a mesh of " +
                      std::to_string(fitting) +
                      " unknowns would fit: ask for a coarser one (displacement_tolerance, elements_across_adhesion), "
                      "allow more (memory_limit_GB), or take the model 'layer'");
  }
  Panels<Real> panels;
  if (!factorise(matrix, s, options.threads, panels)) {
    throw NotSolved(Report{.reason = "the substrate's stiffness matrix is not positive definite to rounding: the "
                                     "Poisson ratio is too near 1/2"});
  }
  return panels;
}

void solve_block(const Supernodes& s, const Panels<double>& panels, const std::vector<char>& is_needed, int width,
                 std::vector<double>& values) {
  solve_panels(s, panels, is_needed, width, values.data());
}

void solve_block(const Supernodes& s, const Panels<float>& panels, const std::vector<char>& is_needed, int width,
                 std::vector<double>& values) {
  std::vector<float> rounded(values.begin(), values.end());
  solve_panels(s, panels, is_needed, width, rounded.data());
  std::copy(rounded.begin(), rounded.end(), values.begin());
}

}  // namespace

struct SparseCholesky::Impl {
  Supernodes supernodes;
  std::variant<Panels<double>, Panels<float>> panels;
  int n = 0;
  int threads = 1;
  double factor_GB = 0;
  std::string cache_note;
};

SparseCholesky::SparseCholesky(const BlockMatrix& matrix, const FactorOptions& options)
    : impl_(std::make_unique<Impl>()) {
  impl_->n = 3 * matrix.n;
  impl_->threads = options.threads;
  impl_->supernodes = analyse(matrix);
  const Supernodes& s = impl_->supernodes;
  const bool is_single = options.precision == Precision::single_;
  for (int k = 0; k < s.count(); ++k) impl_->factor_GB += (is_single ? 36e-9 : 72e-9) * s.n_rows(k) * s.n_columns(k);
  keep_blas_to_one_thread();
  if (is_single) {
    impl_->panels = factor_of<float>(matrix, s, options);
    return;
  }
  if (options.cache_folder.empty()) {
    impl_->panels = factor_of<double>(matrix, s, options);
    return;
  }
  const FactorFile file(options.cache_folder, matrix, s);
  CachedFactor cached = file.read();
  impl_->cache_note = cached.note;
  if (cached.panels) {
    impl_->panels = std::move(*cached.panels);
    return;
  }
  Panels<double> panels = factor_of<double>(matrix, s, options);
  impl_->cache_note += file.write(panels);
  impl_->panels = std::move(panels);
}

SparseCholesky::~SparseCholesky() = default;

double SparseCholesky::factor_GB() const { return impl_->factor_GB; }

const std::string& SparseCholesky::cache_note() const { return impl_->cache_note; }

void SparseCholesky::solve(int n_columns, const std::vector<int>& needed, const Use& fill, const Use& take) const {
  const Supernodes& s = impl_->supernodes;
  std::vector<char> is_column_needed(impl_->n / 3, 0), is_needed(s.count(), 0);
  for (const int node : needed) is_column_needed[s.place[node]] = 1;
  for (int k = 0; k < s.count(); ++k) {
    for (int column = s.first[k]; column < s.first[k + 1]; ++column) is_needed[k] |= is_column_needed[column];
    if (is_needed[k] && s.parent[k] >= 0) is_needed[s.parent[k]] = 1;
  }
  keep_blas_to_one_thread();
  const int n_blocks = (n_columns + kBlockColumns - 1) / kBlockColumns;
  parallel_for(n_blocks, impl_->threads, [&](int block) {
    const int first = block * kBlockColumns;
    const int width = std::min(kBlockColumns, n_columns - first);
    std::vector<double> values(static_cast<std::size_t>(impl_->n) * width, 0.0);
    for (int k = 0; k < width; ++k) fill(first + k, {&values[k], width, s.place});
    std::visit([&](const auto& panels) { solve_block(s, panels, is_needed, width, values); }, impl_->panels);
    for (int k = 0; k < width; ++k) take(first + k, {&values[k], width, s.place});
  });
}

}  // namespace mbtfm::numerics
