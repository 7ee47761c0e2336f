#include "pipeline/numerics/block_cholesky.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "pipeline/numerics/dense_panel.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::numerics {
namespace {

// A pivot below this part of its original diagonal is what rounding leaves of zero: elimination subtracts numbers as
// large as the diagonal, some ten for each entry, each wrong by 1e-16 of it.
constexpr double kLostPivot = 1e-14;
constexpr int kColumnsATime = 16;  // blocks: of an update, by one thread

/// Add a child's columns [begin, end) to a matrix of the parent: those of its columns, or those below.
template <int kBlock, class Real>
void add_columns(const EliminationPanel& child, const Real* update, int begin, int end, Real* to, std::size_t stride,
                 int first_place) {
  const std::size_t from_stride = kBlock * child.rows.size();
  const auto after = [](int column, const EliminationPanel::Run& run) { return column < run.row; };
  auto columns = std::upper_bound(child.runs.begin(), child.runs.end(), begin, after) - 1;
  for (; columns != child.runs.end() && columns->row < end; ++columns) {
    const int first = std::max(begin, columns->row), last = std::min(end, columns->row + columns->length);
    for (int column = first; column < last; ++column) {
      const int place = columns->place + column - columns->row - first_place;
      for (int side = 0; side < kBlock; ++side) {
        const Real* from = update + (kBlock * static_cast<std::size_t>(column) + side) * from_stride;
        Real* t = to + (kBlock * static_cast<std::size_t>(place) + side) * stride;
        for (auto rows = columns; rows != child.runs.end(); ++rows) {
          const int skipped = rows == columns ? column - rows->row : 0;
          const Real* f = from + kBlock * (rows->row + skipped);
          Real* at = t + kBlock * (rows->place + skipped - first_place);
          for (int i = 0; i < kBlock * (rows->length - skipped); ++i) at[i] += f[i];
        }
      }
    }
  }
}

}  // namespace

template <int kBlock, class Real>
void BlockCholesky<kBlock, Real>::assemble(const Panel& panel, const BlockMatrix<kBlock>& matrix, double shift) {
  Real* values = values_of(panel);
  const std::size_t stride = kBlock * panel.height();
  std::fill_n(values, stride * kBlock * panel.n_columns, Real(0));
  for (const Panel::Entry& entry : panel.entries) {
    const double* block = &matrix.value[kBlock * kBlock * static_cast<std::size_t>(entry.slot)];
    Real* to = values + kBlock * entry.column * stride + kBlock * static_cast<std::size_t>(entry.row);
    for (int p = 0; p < kBlock; ++p)
      for (int q = 0; q < kBlock; ++q)
        to[q * stride + p] = static_cast<Real>(block[entry.is_turned ? kBlock * q + p : kBlock * p + q]);
  }
  for (int j = 0; shift != 0 && j < kBlock * panel.n_columns; ++j) values[j * (stride + 1)] += static_cast<Real>(shift);
}

/// To the panel's columns what its children have there, or the rest to what it hands on itself. Of an update only what
/// lies on and below the diagonal counts.
template <int kBlock, class Real>
void BlockCholesky<kBlock, Real>::add_updates(const Panel& panel, bool to_columns, const Updates& updates,
                                              int threads) {
  Real* to = to_columns ? values_of(panel) : updates[&panel - elimination_->panels.data()].get();
  const std::size_t stride = kBlock * (to_columns ? panel.height() : panel.rows.size());
  for (const int c : panel.children) {
    const Panel& child = elimination_->panels[c];
    const int begin = to_columns ? 0 : child.n_rows_in_columns;
    const int end = to_columns ? child.n_rows_in_columns : static_cast<int>(child.rows.size());
    const auto add = [&](int from, int until) {
      add_columns<kBlock>(child, updates[c].get(), from, until, to, stride, to_columns ? 0 : panel.n_columns);
    };
    if (threads == 1) {
      add(begin, end);
    } else {
      parallel_for((end - begin + kColumnsATime - 1) / kColumnsATime, threads,
                   [&](int t) { add(begin + t * kColumnsATime, std::min(begin + (t + 1) * kColumnsATime, end)); });
    }
  }
}

template <int kBlock, class Real>
bool BlockCholesky<kBlock, Real>::eliminate(const Panel& panel, const BlockMatrix<kBlock>& matrix,
                                            const FactoriseOptions& options, Updates& updates) {
  auto& update = updates[&panel - elimination_->panels.data()];
  Real* values = values_of(panel);
  const std::size_t height = kBlock * panel.height(), width = kBlock * static_cast<std::size_t>(panel.n_columns);
  const bool holds_still = options.lost_pivot == LostPivot::holds_still;
  assemble(panel, matrix, options.shift);
  std::vector<Real> least_pivot(width, 0);
  for (std::size_t j = 0; holds_still && j < width; ++j)
    least_pivot[j] = static_cast<Real>(kLostPivot) * values[j * (height + 1)];
  add_updates(panel, true, updates, options.threads);
  update = std::make_unique_for_overwrite<Real[]>(kBlock * kBlock * panel.n_update_blocks());
  partial_cholesky<Real>({values, height, width}, least_pivot.data(), update.get(), options.threads);
  for (std::size_t j = 0; !holds_still && j < width; ++j)
    if (!std::isfinite(values[j * (height + 1)])) return false;
  add_updates(panel, false, updates, options.threads);
  for (const int child : panel.children) updates[child].reset();
  return true;
}

template <int kBlock, class Real>
bool BlockCholesky<kBlock, Real>::factorise(const BlockMatrix<kBlock>& matrix, const FactoriseOptions& options) {
  const std::vector<Panel>& panels = elimination_->panels;
  factor_.resize(static_cast<Eigen::Index>(kBlock * kBlock * elimination_->n_blocks()));
  Updates updates(panels.size());
  if (options.threads == 1)
    return std::all_of(panels.begin(), panels.end(),
                       [&](const Panel& panel) { return eliminate(panel, matrix, options, updates); });
  FactoriseOptions alone = options;
  alone.threads = 1;
  std::atomic<bool> is_positive = true;
  parallel_for(static_cast<int>(elimination_->subtrees.size()), options.threads, [&](int t) {
    for (const int k : elimination_->subtrees[t])
      if (is_positive && !eliminate(panels[k], matrix, alone, updates)) is_positive = false;
  });
  return is_positive && std::all_of(elimination_->above.begin(), elimination_->above.end(),
                                    [&](int k) { return eliminate(panels[k], matrix, options, updates); });
}

template <int kBlock, class Real>
void BlockCholesky<kBlock, Real>::solve(Real* x, std::size_t n, const std::vector<char>& is_needed) const {
  const std::vector<Panel>& panels = elimination_->panels;
  const auto dense = [&](const Panel& panel) {
    return DensePanel<const Real>{factor_.data() + kBlock * kBlock * panel.at, kBlock * panel.height(),
                                  kBlock * static_cast<std::size_t>(panel.n_columns)};
  };
  std::vector<Real> rows;  // of a panel: its own, then those below
  std::vector<char> is_active(panels.size(), 0);
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const Panel& panel = panels[k];
    const std::size_t n_own = kBlock * n * static_cast<std::size_t>(panel.n_columns);
    Real* own = x + kBlock * n * static_cast<std::size_t>(panel.first);
    if (!is_active[k] && std::all_of(own, own + n_own, [](Real number) { return number == 0; })) continue;
    if (panel.parent >= 0) is_active[panel.parent] = 1;
    rows.assign(kBlock * n * panel.height(), 0);
    std::copy_n(own, n_own, rows.data());
    solve_lower(dense(panel), rows.data(), n);
    std::copy_n(rows.data(), n_own, own);
    const Real* change = rows.data() + n_own;
    for (const int row : panel.rows)
      for (Real *to = x + kBlock * n * static_cast<std::size_t>(row), *end = to + kBlock * n; to != end; ++to)
        *to += *change++;
  }
  for (std::size_t k = panels.size(); k-- > 0;) {
    if (!is_needed.empty() && !is_needed[k]) continue;
    const Panel& panel = panels[k];
    const std::size_t n_own = kBlock * n * static_cast<std::size_t>(panel.n_columns);
    Real* own = x + kBlock * n * static_cast<std::size_t>(panel.first);
    rows.resize(kBlock * n * panel.height());
    Real* to = std::copy_n(own, n_own, rows.data());
    for (const int row : panel.rows) to = std::copy_n(x + kBlock * n * static_cast<std::size_t>(row), kBlock * n, to);
    solve_upper(dense(panel), rows.data(), n);
    std::copy_n(rows.data(), n_own, own);
  }
}

template class BlockCholesky<2, double>;
template class BlockCholesky<3, double>;
template class BlockCholesky<3, float>;

}  // namespace mbtfm::numerics
