#include "pipeline/numerics/block_cholesky.h"

#include <metis.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense_panel.h"

namespace mbtfm::numerics {
namespace {

using Block = BlockCholesky::Block;
using Lists = std::vector<std::vector<int>>;

// A pivot below this part of its original diagonal is what rounding leaves of zero: elimination subtracts numbers as
// large as the diagonal, some ten for each entry, each wrong by 1e-16 of it.
constexpr double kLostPivot = 1e-14;
// A panel joins the one that it updates where the zeros that this stores stay below this part of the blocks, or where
// both together are so narrow that the work for them is less than that for a panel.
constexpr double kStoredZeros = 0.05;
constexpr int kNarrow = 4;

using PanelMap = Eigen::Map<Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;

Lists neighbours(int n_blocks, const std::vector<std::array<int, 2>>& pairs) {
  Lists result(n_blocks);
  for (const auto& [i, j] : pairs) {
    result[i].push_back(j);
    result[j].push_back(i);
  }
  for (std::vector<int>& list : result) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return result;
}

// METIS's separators may leave one side so many thousandths larger than half, and are the best of so many tries. Its
// own settings (200 and 1) lead to 4 to 13 % more arithmetic at 4 000, 20 000 and 100 000 vertices.
constexpr idx_t kUneven = 400;
constexpr idx_t kSeparatorTries = 3;

/// By place in the order of elimination: the block. With the minimum degree order the factorisation takes a tenth to a
/// quarter more time at 1 000 to 5 000 vertices, and twice as long at 50 000.
std::vector<int> nested_dissection(const Lists& graph) {
  if (graph.empty()) return {};  // which METIS does not take
  idx_t n = static_cast<idx_t>(graph.size());
  std::vector<idx_t> start{0}, adjacent, block_at(n), place(n);
  for (const std::vector<int>& list : graph) {
    adjacent.insert(adjacent.end(), list.begin(), list.end());
    start.push_back(static_cast<idx_t>(adjacent.size()));
  }
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_UFACTOR] = kUneven;
  options[METIS_OPTION_NSEPS] = kSeparatorTries;
  static std::mutex mutex;  // METIS seeds and draws from the C library's one random generator
  const std::lock_guard lock(mutex);
  const int status = METIS_NodeND(&n, start.data(), adjacent.data(), nullptr, options, block_at.data(), place.data());
  if (status != METIS_OK) throw InternalError("METIS_NodeND: status " + std::to_string(status));
  return {block_at.begin(), block_at.end()};
}

std::vector<int> places(const std::vector<int>& block_at) {
  std::vector<int> place(block_at.size());
  for (std::size_t k = 0; k < block_at.size(); ++k) place[block_at[k]] = static_cast<int>(k);
  return place;
}

/// Elimination tree (Liu 1990): by place, the first below it that it updates, or −1.
std::vector<int> elimination_tree(const Lists& graph, const std::vector<int>& block_at) {
  const std::vector<int> place = places(block_at);
  const int n = static_cast<int>(place.size());
  std::vector<int> parent(n, -1), ancestor(n, -1);
  for (int k = 0; k < n; ++k)
    for (const int neighbour : graph[block_at[k]])
      for (int i = place[neighbour], next = 0; i >= 0 && i < k; i = next) {
        next = ancestor[i];
        ancestor[i] = k;
        if (next < 0) parent[i] = k;
        if (next == k) break;
      }
  return parent;
}

/// The same elimination with each subtree in a row, children before parents.
std::vector<int> in_postorder(const std::vector<int>& block_at, const std::vector<int>& parent) {
  const int n = static_cast<int>(parent.size());
  std::vector<int> size(n, 1);
  for (int k = 0; k < n; ++k)
    if (parent[k] >= 0) size[parent[k]] += size[k];
  int next_root = 0;
  std::vector<int> next(n), result(n);  // next: by parent, where the subtree of its next child begins
  for (int k = n - 1; k >= 0; --k) {    // parents first
    int& begin = parent[k] < 0 ? next_root : next[parent[k]];
    next[k] = begin;
    begin += size[k];
    result[begin - 1] = block_at[k];
  }
  return result;
}

/// By column of the factor: the rows below its diagonal, rising.
Lists rows_below(const Lists& graph, const std::vector<int>& block_at, const std::vector<int>& parent) {
  const std::vector<int> place = places(block_at);
  const int n = static_cast<int>(place.size());
  Lists below(n), children(n);
  std::vector<int> seen(n, -1);
  for (int k = 0; k < n; ++k) {
    const auto add = [&](int row) {
      if (row <= k || seen[row] == k) return;
      seen[row] = k;
      below[k].push_back(row);
    };
    for (const int neighbour : graph[block_at[k]]) add(place[neighbour]);
    for (const int child : children[k])
      for (const int row : below[child]) add(row);
    std::sort(below[k].begin(), below[k].end());
    if (parent[k] >= 0) children[parent[k]].push_back(k);
  }
  return below;
}

}  // namespace

/// Neighbouring columns of the factor with the same rows below them.
struct BlockCholesky::Panel {
  int first = 0, n_columns = 0;  // blocks
  std::vector<int> rows;         // below its columns, rising
  double filled = 0;             // of its blocks on and below the diagonal: those that are not zero

  int parent = -1;  // the panel that takes its update
  int stack = 0;    // that its update waits on; its children's are on the other
  struct Run {
    int row, place, length;
  };
  std::vector<Run> runs;   // rows that are also in a row among the columns and rows of the parent
  std::size_t values = 0;  // its place in the factor: (columns + rows) × columns, column-major
  struct Entry {
    int row, column, slot;
  };
  std::vector<Entry> entries;  // of the matrix, off the diagonal

  int height() const { return n_columns + static_cast<int>(rows.size()); }
  template <class Value>
  DensePanel<Value> in(Value* factor) const {
    return {factor + values, 2 * static_cast<std::size_t>(height()), 2 * static_cast<std::size_t>(n_columns)};
  }
  std::size_t update_size() const { return 4 * rows.size() * rows.size(); }
  int place_of(int row) const {
    if (row < first + n_columns) return row - first;
    return n_columns + static_cast<int>(std::lower_bound(rows.begin(), rows.end(), row) - rows.begin());
  }
};

struct BlockCholesky::Pattern {
  std::vector<int> place;  // of a block in the order of elimination
  struct Spring {
    int low, high, slot;
  };
  std::vector<Spring> springs;  // by pair, in the order of elimination
  std::vector<Panel> panels;    // children before parents
  std::size_t n_values = 0, n_slots = 0;
  std::array<std::size_t, 2> n_update_values{};

  void find_panels(Lists below);
  void tie_panels();
  void store_pairs(const std::vector<std::array<int, 2>>& pairs);
  std::vector<int> panel_of_column() const;
};

void BlockCholesky::Pattern::find_panels(Lists below) {
  for (int k = 0; k < static_cast<int>(below.size()); ++k) {
    Panel panel;
    panel.first = k;
    panel.n_columns = 1;
    panel.rows = std::move(below[k]);
    panel.filled = 1 + static_cast<double>(panel.rows.size());
    while (!panels.empty() && !panels.back().rows.empty() && panels.back().rows.front() == panel.first) {
      const int n_columns = panels.back().n_columns + panel.n_columns;
      const double filled = panels.back().filled + panel.filled;
      const double stored = n_columns * (0.5 * (n_columns + 1) + static_cast<double>(panel.rows.size()));
      if (n_columns > kNarrow && filled < (1 - kStoredZeros) * stored) break;
      panel.first = panels.back().first;
      panel.n_columns = n_columns;
      panel.filled = filled;
      panels.pop_back();
    }
    panels.push_back(std::move(panel));
  }
}

std::vector<int> BlockCholesky::Pattern::panel_of_column() const {
  std::vector<int> result;
  for (std::size_t s = 0; s < panels.size(); ++s) result.insert(result.end(), panels[s].n_columns, static_cast<int>(s));
  return result;
}

void BlockCholesky::Pattern::tie_panels() {
  const std::vector<int> panel_of = panel_of_column();
  for (std::size_t s = panels.size(); s-- > 0;) {  // parents first
    Panel& panel = panels[s];
    if (panel.rows.empty()) continue;
    panel.parent = panel_of[panel.rows.front()];
    const Panel& parent = panels[panel.parent];
    panel.stack = 1 - parent.stack;
    for (int a = 0; a < static_cast<int>(panel.rows.size()); ++a) {
      const int in_parent = parent.place_of(panel.rows[a]);
      if (a == 0 || in_parent != panel.runs.back().place + panel.runs.back().length || in_parent == parent.n_columns)
        panel.runs.push_back({a, in_parent, 0});
      ++panel.runs.back().length;
    }
  }
  std::vector<std::size_t> waiting(panels.size(), 0);  // values of the children's updates
  std::array<std::size_t, 2> stacked{};
  for (std::size_t s = 0; s < panels.size(); ++s) {
    Panel& panel = panels[s];
    panel.values = n_values;
    n_values += 4 * static_cast<std::size_t>(panel.height()) * panel.n_columns;
    stacked[panel.stack] += panel.update_size();
    stacked[1 - panel.stack] -= waiting[s];
    n_update_values[panel.stack] = std::max(n_update_values[panel.stack], stacked[panel.stack]);
    if (panel.parent >= 0) waiting[panel.parent] += panel.update_size();
  }
}

void BlockCholesky::Pattern::store_pairs(const std::vector<std::array<int, 2>>& pairs) {
  std::vector<std::array<int, 2>> entries;  // (column, row), column < row
  for (const auto& [i, j] : pairs) entries.push_back({std::min(place[i], place[j]), std::max(place[i], place[j])});
  std::vector<std::array<int, 2>> unique = entries;
  std::sort(unique.begin(), unique.end());
  unique.erase(std::unique(unique.begin(), unique.end()), unique.end());
  n_slots = unique.size();
  for (const auto& entry : entries) {
    const auto slot = std::lower_bound(unique.begin(), unique.end(), entry) - unique.begin();
    springs.push_back({entry[0], entry[1], static_cast<int>(slot)});
  }
  const std::vector<int> panel_of = panel_of_column();
  for (std::size_t slot = 0; slot < unique.size(); ++slot) {
    const auto [column, row] = unique[slot];
    Panel& panel = panels[panel_of[column]];
    panel.entries.push_back({panel.place_of(row), panel.place_of(column), static_cast<int>(slot)});
  }
}

BlockCholesky::BlockCholesky(int n_blocks, const std::vector<std::array<int, 2>>& pairs) : diagonal_(n_blocks) {
  const Lists graph = neighbours(n_blocks, pairs);
  std::vector<int> block_at = nested_dissection(graph);
  block_at = in_postorder(block_at, elimination_tree(graph, block_at));
  auto pattern = std::make_shared<Pattern>();
  pattern->place = places(block_at);
  pattern->find_panels(rows_below(graph, block_at, elimination_tree(graph, block_at)));
  pattern->tie_panels();
  pattern->store_pairs(pairs);
  off_diagonal_.resize(pattern->n_slots);
  factor_.resize(pattern->n_values);
  for (int i = 0; i < 2; ++i) updates_[i].resize(pattern->n_update_values[i]);
  pattern_ = std::move(pattern);
}

void BlockCholesky::set_zero() {
  std::fill(diagonal_.begin(), diagonal_.end(), Block::Zero());
  std::fill(off_diagonal_.begin(), off_diagonal_.end(), Block::Zero());
}

void BlockCholesky::add_spring(int pair, const Block& stiffness) {
  const Pattern::Spring& spring = pattern_->springs[pair];
  diagonal_[spring.low] += stiffness;
  diagonal_[spring.high] += stiffness;
  off_diagonal_[spring.slot] -= stiffness;
}

void BlockCholesky::add_diagonal(int i, const Block& stiffness) { diagonal_[pattern_->place[i]] += stiffness; }

void BlockCholesky::assemble(const Panel& panel, double shift) {
  double* values = factor_.data() + panel.values;
  const std::size_t stride = 2 * static_cast<std::size_t>(panel.height());
  std::fill_n(values, stride * 2 * panel.n_columns, 0.0);
  const auto put = [&](int row, int column, const Block& block) {
    PanelMap(values + 2 * column * stride + 2 * row, 2, 2, Eigen::OuterStride<>(stride)) = block;
  };
  for (int j = 0; j < panel.n_columns; ++j) put(j, j, diagonal_[panel.first + j] + shift * Block::Identity());
  for (const Panel::Entry& entry : panel.entries) put(entry.row, entry.column, off_diagonal_[entry.slot]);
}

// Of the update only what lies on and below the diagonal counts.
void BlockCholesky::add_update(const Panel& child, const double* update, const Panel& panel, Part part,
                               double* own_update) {
  const std::size_t n_rows = child.rows.size(), height = panel.height(), n_columns = panel.n_columns;
  for (const Panel::Run& columns : child.runs) {
    const bool is_column = static_cast<std::size_t>(columns.place) < n_columns;
    if (is_column != (part == Part::columns)) continue;
    for (int side = 0; side < 2 * columns.length; ++side) {
      const std::size_t column = 2 * columns.place + side;
      const double* from = update + (2 * columns.row + side) * 2 * n_rows;
      double* to = is_column ? factor_.data() + panel.values + column * 2 * height
                             : own_update + (column - 2 * n_columns) * 2 * (height - n_columns) - 2 * n_columns;
      for (const Panel::Run* rows = &columns; rows != child.runs.data() + child.runs.size(); ++rows) {
        const int first = rows == &columns ? side / 2 : 0;
        const double* f = from + 2 * (rows->row + first);
        double* t = to + 2 * (rows->place + first);
        for (int i = 0; i < 2 * (rows->length - first); ++i) t[i] += f[i];
      }
    }
  }
}

void BlockCholesky::eliminate(const Panel& panel, double* update, double shift) {
  std::vector<double> least_pivot(2 * panel.n_columns);
  for (int j = 0; j < 2 * panel.n_columns; ++j)
    least_pivot[j] = kLostPivot * (diagonal_[panel.first + j / 2](j % 2, j % 2) + shift);
  partial_cholesky(panel.in(factor_.data()), least_pivot.data(), update);
}

bool BlockCholesky::is_parent(const Panel& panel, const Panel& child) const {
  return child.parent == static_cast<int>(&panel - pattern_->panels.data());
}

void BlockCholesky::factorise(double shift) {
  double mean_diagonal = 0;
  for (const Block& block : diagonal_) mean_diagonal += block.trace() / (2 * n_blocks());
  std::vector<const Panel*> waiting;  // with an update on a stack
  std::array<double*, 2> top{updates_[0].data(), updates_[1].data()};
  for (const Panel& panel : pattern_->panels) {
    double*& childrens = top[1 - panel.stack];
    double* own = top[panel.stack];
    const auto each_child = [&](auto use) {
      const double* update = childrens;
      for (auto child = waiting.rbegin(); child != waiting.rend() && is_parent(panel, **child); ++child)
        use(**child, update -= (*child)->update_size());
    };
    assemble(panel, shift * mean_diagonal);
    each_child([&](const Panel& child, const double* update) { add_update(child, update, panel, Part::columns, own); });
    eliminate(panel, own, shift * mean_diagonal);
    each_child([&](const Panel& child, const double* update) { add_update(child, update, panel, Part::rest, own); });
    while (!waiting.empty() && is_parent(panel, *waiting.back())) {
      childrens -= waiting.back()->update_size();
      waiting.pop_back();
    }
    if (panel.rows.empty()) continue;
    top[panel.stack] += panel.update_size();
    waiting.push_back(&panel);
  }
}

void BlockCholesky::solve(Columns& columns) const {
  const auto n_columns = static_cast<std::size_t>(columns.cols());
  const std::size_t n = n_columns == 1 ? 1 : (n_columns + kRightHandSides - 1) / kRightHandSides * kRightHandSides;
  Columns in_order = Columns::Zero(columns.rows(), static_cast<Eigen::Index>(n));  // of elimination
  for (int i = 0; i < n_blocks(); ++i)
    in_order.middleRows<2>(2 * pattern_->place[i]).leftCols(columns.cols()) = columns.middleRows<2>(2 * i);
  double* const x = in_order.data();
  std::vector<double> rows;  // of a panel: its own, then those below
  for (const Panel& panel : pattern_->panels) {
    const std::size_t n_own = 2 * n * panel.n_columns;
    double* own = x + 2 * n * panel.first;
    rows.assign(2 * n * panel.height(), 0);
    std::copy_n(own, n_own, rows.data());
    solve_lower(panel.in(factor_.data()), rows.data(), n);
    std::copy_n(rows.data(), n_own, own);
    const double* change = rows.data() + n_own;
    for (const int row : panel.rows)
      for (double *to = x + 2 * n * row, *end = to + 2 * n; to != end; ++to) *to += *change++;
  }
  for (auto panel = pattern_->panels.rbegin(); panel != pattern_->panels.rend(); ++panel) {
    const std::size_t n_own = 2 * n * panel->n_columns;
    double* own = x + 2 * n * panel->first;
    rows.resize(2 * n * panel->height());
    double* to = std::copy_n(own, n_own, rows.data());
    for (const int row : panel->rows) to = std::copy_n(x + 2 * n * row, 2 * n, to);
    solve_upper(panel->in(factor_.data()), rows.data(), n);
    std::copy_n(rows.data(), n_own, own);
  }
  for (int i = 0; i < n_blocks(); ++i)
    columns.middleRows<2>(2 * i) = in_order.middleRows<2>(2 * pattern_->place[i]).leftCols(columns.cols());
}

}  // namespace mbtfm::numerics
