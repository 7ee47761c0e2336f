/// What a sparse Cholesky factorisation does before it sees a number: the order of elimination, the panels of its
/// factor, and what each hands on. Blocks of any size, one for each node.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace mbtfm::numerics {

/// The blocks of the lower triangle of a symmetric matrix that may be filled, by block columns.
struct BlockPattern {
  int n = 0;
  std::vector<int> start;  ///< by column, n + 1
  std::vector<int> row;    ///< block rows, rising, the first of a column its diagonal
  int slot(int at_row, int column) const {
    const auto end = row.begin() + start[column + 1];
    return static_cast<int>(std::lower_bound(row.begin() + start[column], end, at_row) - row.begin());
  }
};

/// Neighbouring columns of the factor with the same rows below them: a dense matrix of height() × n_columns blocks.
struct EliminationPanel {
  int first = 0, n_columns = 0;
  std::vector<int> rows;  ///< below its columns, rising
  int parent = -1;        ///< the panel that takes its update; -1: a root
  std::vector<int> children;
  std::size_t at = 0;  ///< blocks of the panels before
  struct Run {
    int row, place, length;
  };
  std::vector<Run> runs;      ///< rows that are also in a row among the columns and rows of the parent
  int n_rows_in_columns = 0;  ///< of its rows: those that are columns of the parent
  struct Entry {
    int row, column, slot;  ///< of the panel, of the matrix
    bool is_turned;         ///< it is transposed there
  };
  std::vector<Entry> entries;

  std::size_t height() const { return static_cast<std::size_t>(n_columns) + rows.size(); }
  std::size_t n_blocks() const { return height() * static_cast<std::size_t>(n_columns); }
  std::size_t n_update_numbers(int rows_of_block) const;  ///< of what it hands on: TriangleStrips
  int place_of(int row) const;
};

/// How long to look for an order: little for one factorisation, longer for many.
enum class Search { quick, thorough };

struct Elimination {
  /// Nested dissection (METIS), elimination tree, panels. @throws InternalError where METIS fails
  Elimination(const BlockPattern& pattern, Search search);

  /// Subtrees side by side, each run whole; then the panels above them, one after the other.
  struct Stage {
    std::vector<std::vector<int>> subtrees;  ///< by falling work
    std::vector<int> above;                  ///< children first
  };

  std::vector<int> place;                ///< by node: its column of the factor
  std::vector<EliminationPanel> panels;  ///< children before parents
  std::vector<Stage> stages;             ///< in turn, so that few subtrees wait for their parents at a time

  std::size_t n_blocks() const;  ///< of the factor
  /// The most numbers that updates take at a time where the panels come one after the other.
  std::size_t most_update_numbers(int rows_of_block) const;
  /// The most numbers that the factor and the updates take at a time, for any number of threads and blocks of so many
  /// rows.
  double most_numbers(int rows_of_block) const;

 private:
  void find_panels(const std::vector<std::vector<int>>& graph, const std::vector<int>& node_at);
  void tie_panels();
  void store_entries(const BlockPattern& pattern);
  void find_stages();
  std::vector<int> panel_of_column() const;
};

}  // namespace mbtfm::numerics
