#include "pipeline/numerics/elimination.h"

#include <metis.h>

#include <algorithm>
#include <mutex>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense_panel.h"

namespace mbtfm::numerics {
namespace {

using Lists = std::vector<std::vector<int>>;

// A panel joins the one that it updates where the zeros that this stores stay below this part of the blocks, or where
// both together are so narrow that the work for them is less than that for a panel.
constexpr double kStoredZeros = 0.05;
constexpr int kNarrow = 4;
// Subtrees of at most this share of the work run side by side, until they are that share of it: enough of them to
// balance a handful of threads, few enough that what they hand on stays small beside the factor
constexpr double kSubtreeShare = 1.0 / 128, kStageShare = 1.0 / 8;

/// By node: its neighbours, rising.
Lists neighbours(const BlockPattern& pattern) {
  Lists result(pattern.n);
  for (int column = 0; column < pattern.n; ++column)
    for (int k = pattern.start[column] + 1; k < pattern.start[column + 1]; ++k) {
      result[column].push_back(pattern.row[k]);
      result[pattern.row[k]].push_back(column);
    }
  for (std::vector<int>& list : result) std::ranges::sort(list);
  return result;
}

// METIS's separators may leave one side so many thousandths larger than half, and are the best of so many tries. Its
// own settings (200 and 1) lead to 4 to 13 % more arithmetic at 4 000, 20 000 and 100 000 vertices, in a third of the
// time.
constexpr idx_t kUneven = 400;
constexpr idx_t kSeparatorTries = 3;

/// By place in the order of elimination: the node. With the minimum degree order the factorisation takes a tenth to a
/// quarter more time at 1 000 to 5 000 vertices, and twice as long at 50 000.
std::vector<int> nested_dissection(const Lists& graph, Search search) {
  if (graph.empty()) return {};  // which METIS does not take
  idx_t n = static_cast<idx_t>(graph.size());
  std::vector<idx_t> start{0}, adjacent, node_at(n), place(n);
  for (const std::vector<int>& list : graph) {
    adjacent.insert(adjacent.end(), list.begin(), list.end());
    start.push_back(static_cast<idx_t>(adjacent.size()));
  }
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  if (search == Search::thorough) {
    options[METIS_OPTION_UFACTOR] = kUneven;
    options[METIS_OPTION_NSEPS] = kSeparatorTries;
  }
  static std::mutex mutex;  // METIS seeds and draws from the C library's one random generator
  const std::lock_guard lock(mutex);
  const int status = METIS_NodeND(&n, start.data(), adjacent.data(), nullptr, options, node_at.data(), place.data());
  if (status == METIS_ERROR_MEMORY) throw OutOfMemory("the equations could not be ordered: out of memory");
  if (status != METIS_OK) throw InternalError("METIS_NodeND: status " + std::to_string(status));
  return {node_at.begin(), node_at.end()};
}

std::vector<int> places(const std::vector<int>& node_at) {
  std::vector<int> place(node_at.size());
  for (std::size_t k = 0; k < node_at.size(); ++k) place[node_at[k]] = static_cast<int>(k);
  return place;
}

/// Elimination tree (Liu 1990): by place, the first below it that it updates, or −1.
std::vector<int> elimination_tree(const Lists& graph, const std::vector<int>& node_at) {
  const std::vector<int> place = places(node_at);
  const int n = static_cast<int>(place.size());
  std::vector<int> parent(n, -1), ancestor(n, -1);
  for (int k = 0; k < n; ++k)
    for (const int neighbour : graph[node_at[k]])
      for (int i = place[neighbour], next = 0; i >= 0 && i < k; i = next) {
        next = ancestor[i];
        ancestor[i] = k;
        if (next < 0) parent[i] = k;
        if (next == k) break;
      }
  return parent;
}

/// The same elimination with each subtree in a row, children before parents.
std::vector<int> in_postorder(const std::vector<int>& node_at, const std::vector<int>& parent) {
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
    result[begin - 1] = node_at[k];
  }
  return result;
}

double work_of(const EliminationPanel& panel) {
  const auto rows = static_cast<double>(panel.height());
  return panel.n_columns * rows * rows;
}

}  // namespace

std::size_t EliminationPanel::n_update_numbers(int rows_of_block) const {
  return TriangleStrips{static_cast<std::size_t>(rows_of_block) * rows.size()}.size();
}

int EliminationPanel::place_of(int row) const {
  if (row < first + n_columns) return row - first;
  return n_columns + static_cast<int>(std::lower_bound(rows.begin(), rows.end(), row) - rows.begin());
}

Elimination::Elimination(const BlockPattern& pattern, Search search) {
  const Lists graph = neighbours(pattern);
  std::vector<int> node_at = nested_dissection(graph, search);
  node_at = in_postorder(node_at, elimination_tree(graph, node_at));
  place = places(node_at);
  find_panels(graph, node_at);
  tie_panels();
  store_entries(pattern);
  find_stages();
}

void Elimination::find_panels(const Lists& graph, const std::vector<int>& node_at) {
  Lists children(place.size());  // by column: the panels whose first row below it is
  std::vector<double> filled;    // by panel, of its blocks on and below the diagonal: those that are not zero
  for (int k = 0; k < static_cast<int>(place.size()); ++k) {
    std::vector<int> rows, joined;
    for (const int neighbour : graph[node_at[k]])
      if (place[neighbour] > k) rows.push_back(place[neighbour]);
    std::ranges::sort(rows);
    for (const int child : children[k]) {
      const std::vector<int>& more = panels[child].rows;
      joined.clear();
      std::set_union(rows.begin(), rows.end(), more.begin() + 1, more.end(), std::back_inserter(joined));
      rows.swap(joined);
    }
    EliminationPanel panel;
    panel.first = k;
    panel.n_columns = 1;
    double own_filled = 1 + static_cast<double>(rows.size());
    while (!panels.empty() && !panels.back().rows.empty() && panels.back().rows.front() == panel.first) {
      const int n_columns = panels.back().n_columns + panel.n_columns;
      const double stored = n_columns * (0.5 * (n_columns + 1) + static_cast<double>(rows.size()));
      if (n_columns > kNarrow && filled.back() + own_filled < (1 - kStoredZeros) * stored) break;
      panel.first = panels.back().first;
      panel.n_columns = n_columns;
      own_filled += filled.back();
      panels.pop_back();
      filled.pop_back();
    }
    if (!rows.empty()) children[rows.front()].push_back(static_cast<int>(panels.size()));
    panel.rows = std::move(rows);
    panels.push_back(std::move(panel));
    filled.push_back(own_filled);
  }
}

std::vector<int> Elimination::panel_of_column() const {
  std::vector<int> result;
  for (std::size_t s = 0; s < panels.size(); ++s) result.insert(result.end(), panels[s].n_columns, static_cast<int>(s));
  return result;
}

void Elimination::tie_panels() {
  const std::vector<int> panel_of = panel_of_column();
  std::size_t at = 0;
  for (std::size_t s = 0; s < panels.size(); ++s) {
    EliminationPanel& panel = panels[s];
    panel.at = at;
    at += panel.n_blocks();
    if (panel.rows.empty()) continue;
    panel.parent = panel_of[panel.rows.front()];
    EliminationPanel& parent = panels[panel.parent];
    parent.children.push_back(static_cast<int>(s));
    for (int a = 0; a < static_cast<int>(panel.rows.size()); ++a) {
      const int in_parent = parent.place_of(panel.rows[a]);
      if (in_parent < parent.n_columns) ++panel.n_rows_in_columns;
      if (a == 0 || in_parent != panel.runs.back().place + panel.runs.back().length || in_parent == parent.n_columns)
        panel.runs.push_back({a, in_parent, 0});
      ++panel.runs.back().length;
    }
  }
}

void Elimination::store_entries(const BlockPattern& pattern) {
  const std::vector<int> panel_of = panel_of_column();
  for (int column = 0; column < pattern.n; ++column)
    for (int k = pattern.start[column]; k < pattern.start[column + 1]; ++k) {
      const int i = place[pattern.row[k]], j = place[column];
      EliminationPanel& panel = panels[panel_of[std::min(i, j)]];
      panel.entries.push_back({panel.place_of(std::max(i, j)), panel.place_of(std::min(i, j)), k, i < j});
    }
}

void Elimination::find_stages() {
  const int n = static_cast<int>(panels.size());
  std::vector<double> work(n);
  double all = 0;
  for (int k = 0; k < n; ++k) {  // children come before their parents
    work[k] += work_of(panels[k]);
    all += work_of(panels[k]);
    if (panels[k].parent >= 0) work[panels[k].parent] += work[k];
  }
  const auto is_small = [&](int k) { return k >= 0 && work[k] <= kSubtreeShare * all; };
  double taken = 0;
  int root = -1;  // of the subtree that the panel before was of
  for (int k = 0; k < n; ++k) {
    if (stages.empty()) stages.emplace_back();
    if (!is_small(k)) {
      stages.back().above.push_back(k);
      continue;
    }
    if (k > root) {  // each subtree in a row
      for (root = k; is_small(panels[root].parent);) root = panels[root].parent;
      if (taken >= kStageShare * all) {
        stages.emplace_back();
        taken = 0;
      }
      taken += work[root];
      stages.back().subtrees.emplace_back();
    }
    stages.back().subtrees.back().push_back(k);
  }
  for (Stage& stage : stages)
    std::ranges::stable_sort(stage.subtrees,
                             [&](const auto& a, const auto& b) { return work[a.back()] > work[b.back()]; });
}

std::size_t Elimination::n_blocks() const { return panels.empty() ? 0 : panels.back().at + panels.back().n_blocks(); }

std::size_t Elimination::most_update_numbers(int rows_of_block) const {
  std::size_t stack = 0, most = 0;
  for (const EliminationPanel& panel : panels) {
    stack += panel.n_update_numbers(rows_of_block);
    most = std::max(most, stack);
    for (const int child : panel.children) stack -= panels[child].n_update_numbers(rows_of_block);
  }
  return most;
}

double Elimination::most_numbers(int rows_of_block) const {
  double stack = 0, most = 0;
  const auto visit = [&](int k) {
    stack += static_cast<double>(panels[k].n_update_numbers(rows_of_block));
    most = std::max(most, stack);
    for (const int child : panels[k].children)
      stack -= static_cast<double>(panels[child].n_update_numbers(rows_of_block));
  };
  for (const Stage& stage : stages) {
    for (const std::vector<int>& subtree : stage.subtrees)
      for (const int k : subtree) visit(k);
    for (const int k : stage.above) visit(k);
  }
  return static_cast<double>(rows_of_block * rows_of_block) * static_cast<double>(n_blocks()) + most;
}

}  // namespace mbtfm::numerics
