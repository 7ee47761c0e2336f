#include "pipeline/numerics/block_cholesky.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "pipeline/numerics/dense_panel.h"
#include "pipeline/numerics/memory.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::numerics {
namespace {

// A pivot below this part of its original diagonal is what rounding leaves of zero: elimination subtracts numbers as
// large as the diagonal, some ten for each entry, each wrong by 1e-16 of it.
constexpr double kLostPivot = 1e-14;
constexpr int kColumnsATime = 16;  // blocks: of an update, by one thread

/// Add a child's columns [begin, end) to a matrix of the parent: those of its columns, or those below. column_of(place,
/// side) is where a column of it begins with the block of its diagonal.
template <int kBlock, class Real, class ColumnOf>
void add_columns(const EliminationPanel& child, const Real* update, int begin, int end, const ColumnOf& column_of) {
  const TriangleStrips strips{kBlock * child.rows.size()};
  const auto after = [](int column, const EliminationPanel::Run& run) { return column < run.row; };
  auto columns = std::upper_bound(child.runs.begin(), child.runs.end(), begin, after) - 1;
  for (; columns != child.runs.end() && columns->row < end; ++columns) {
    const int first = std::max(begin, columns->row), last = std::min(end, columns->row + columns->length);
    for (int column = first; column < last; ++column) {
      const int place = columns->place + column - columns->row;
      const std::size_t diagonal = kBlock * static_cast<std::size_t>(column);
      for (int side = 0; side < kBlock; ++side) {
        const Real* from = update + strips.at(diagonal, diagonal + static_cast<std::size_t>(side));
        Real* to = column_of(place, side);
        for (auto rows = columns; rows != child.runs.end(); ++rows) {
          const int skipped = rows == columns ? column - rows->row : 0;
          const Real* f = from + kBlock * (rows->row + skipped - column);
          Real* t = to + kBlock * (rows->place + skipped - place);
          for (int i = 0; i < kBlock * (rows->length - skipped); ++i) t[i] += f[i];
        }
      }
    }
  }
}

}  // namespace

template <int kBlock, class Real>
void BlockCholesky<kBlock, Real>::assemble(const Panel& panel, const BlockMatrix<kBlock>& matrix,
                                           const FactoriseOptions& options) {
  Real* values = values_of(panel);
  const std::size_t stride = kBlock * panel.height();
  parallel_for((panel.n_columns + kColumnsATime - 1) / kColumnsATime, options.threads, [&](int t) {
    const int n = std::min(kColumnsATime, panel.n_columns - t * kColumnsATime);
    std::fill_n(values + stride * kBlock * kColumnsATime * t, stride * kBlock * n, Real(0));
  });
  for (const Panel::Entry& entry : panel.entries) {
    const double* block = &matrix.value[kBlock * kBlock * static_cast<std::size_t>(entry.slot)];
    Real* to = values + kBlock * entry.column * stride + kBlock * static_cast<std::size_t>(entry.row);
    for (int p = 0; p < kBlock; ++p)
      for (int q = 0; q < kBlock; ++q)
        to[q * stride + p] = static_cast<Real>(block[entry.is_turned ? kBlock * q + p : kBlock * p + q]);
  }
  for (int j = 0; options.shift != 0 && j < kBlock * panel.n_columns; ++j)
    values[j * (stride + 1)] += static_cast<Real>(options.shift);
}

/// To the panel's columns what its children have there, or the rest to what it hands on itself. Of an update only what
/// lies on and below the diagonal counts.
template <int kBlock, class Real>
void BlockCholesky<kBlock, Real>::add_updates(const Panel& panel, bool to_columns, const Updates& updates,
                                              int threads) {
  Real* to = to_columns ? values_of(panel) : updates[&panel - elimination_->panels.data()];
  const std::size_t height = kBlock * panel.height();
  const TriangleStrips strips{kBlock * panel.rows.size()};
  const auto column_of = [&](int place, int side) {
    const auto row = static_cast<std::size_t>(kBlock * (to_columns ? place : place - panel.n_columns));
    const std::size_t column = row + static_cast<std::size_t>(side);
    return to + (to_columns ? column * height + row : strips.at(row, column));
  };
  for (const int c : panel.children) {
    const Panel& child = elimination_->panels[c];
    const int begin = to_columns ? 0 : child.n_rows_in_columns;
    const int end = to_columns ? child.n_rows_in_columns : static_cast<int>(child.rows.size());
    const auto add = [&](int from, int until) { add_columns<kBlock>(child, updates[c], from, until, column_of); };
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
                                            const FactoriseOptions& options, const Updates& updates) {
  Real* values = values_of(panel);
  const std::size_t height = kBlock * panel.height(), width = kBlock * static_cast<std::size_t>(panel.n_columns);
  const bool holds_still = options.lost_pivot == LostPivot::holds_still;
  assemble(panel, matrix, options);
  std::vector<Real> least_pivot(width, 0);
  for (std::size_t j = 0; holds_still && j < width; ++j)
    least_pivot[j] = static_cast<Real>(kLostPivot) * values[j * (height + 1)];
  add_updates(panel, true, updates, options.threads);
  partial_cholesky<Real>({values, height, width}, least_pivot.data(), updates[&panel - elimination_->panels.data()],
                         options.threads);
  for (std::size_t j = 0; !holds_still && j < width; ++j)
    if (!std::isfinite(values[j * (height + 1)])) return false;
  add_updates(panel, false, updates, options.threads);
  return true;
}

template <int kBlock, class Real>
bool BlockCholesky<kBlock, Real>::factorise(const BlockMatrix<kBlock>& matrix, const FactoriseOptions& options) {
  factor_.resize(static_cast<Eigen::Index>(kBlock * kBlock * elimination_->n_blocks()));
  use_large_pages(factor_.data(), static_cast<std::size_t>(factor_.size()) * sizeof(Real));
  return options.threads == 1 ? factorise_in_a_row(matrix, options) : factorise_side_by_side(matrix, options);
}

/// Updates lie on two stacks that grow from the ends of one array towards each other: on top of one are those of a
/// panel's children, and its own goes onto the other. The system is asked for memory once, not by each panel.
template <int kBlock, class Real>
bool BlockCholesky<kBlock, Real>::factorise_in_a_row(const BlockMatrix<kBlock>& matrix,
                                                     const FactoriseOptions& options) {
  const std::vector<Panel>& panels = elimination_->panels;
  const std::size_t n_numbers = elimination_->most_update_numbers(kBlock);
  const auto numbers = std::make_unique_for_overwrite<Real[]>(n_numbers);
  use_large_pages(numbers.get(), n_numbers * sizeof(Real));
  std::vector<char> is_low(panels.size(), 0);
  for (std::size_t k = panels.size(); k-- > 0;)
    if (panels[k].parent >= 0) is_low[k] = !is_low[panels[k].parent];
  Real *low = numbers.get(), *high = low + n_numbers;
  Updates updates(panels.size());
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const std::size_t own = update_size(panels[k]);
    updates[k] = is_low[k] ? low : high - own;
    (is_low[k] ? low += own : high -= own);
    if (!eliminate(panels[k], matrix, options, updates)) return false;
    for (const int child : panels[k].children)
      (is_low[k] ? high += update_size(panels[child]) : low -= update_size(panels[child]));
  }
  return true;
}

template <int kBlock, class Real>
bool BlockCholesky<kBlock, Real>::factorise_side_by_side(const BlockMatrix<kBlock>& matrix,
                                                         const FactoriseOptions& options) {
  const std::vector<Panel>& panels = elimination_->panels;
  Updates updates(panels.size());
  std::vector<std::unique_ptr<Real[]>> owned(panels.size());
  std::atomic<bool> is_positive = true;
  const auto run = [&](int k, const FactoriseOptions& with) {
    if (!is_positive) return;
    const std::size_t size = update_size(panels[k]);
    owned[k] = std::make_unique_for_overwrite<Real[]>(size);
    use_large_pages(owned[k].get(), size * sizeof(Real));
    updates[k] = owned[k].get();
    if (!eliminate(panels[k], matrix, with, updates)) is_positive = false;
    for (const int child : panels[k].children) owned[child].reset();
  };
  FactoriseOptions alone = options;
  alone.threads = 1;
  for (const auto& stage : elimination_->stages) {
    parallel_for(static_cast<int>(stage.subtrees.size()), options.threads, [&](int t) {
      for (const int k : stage.subtrees[t]) run(k, alone);
    });
    for (const int k : stage.above) run(k, options);
  }
  return is_positive;
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
