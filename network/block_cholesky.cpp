#include "network/block_cholesky.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

namespace mbtfm::network {
namespace {

using Block = BlockCholesky::Block;

// A pivot below this part of its original diagonal is what rounding leaves of zero: elimination subtracts numbers as
// large as the diagonal, some ten for each entry, each wrong by 1e-16 of it.
constexpr double kLostPivot = 1e-14;

double inverse_root(double pivot, double original) {
  return pivot > kLostPivot * original ? 1 / std::sqrt(pivot) : 0;  // 0: the inverse of an infinite pivot
}

/// Inverse of the lower Cholesky factor of a 2×2 block.
Block inverse_cholesky(const Block& pivot, const Block& original) {
  const double a = inverse_root(pivot(0, 0), original(0, 0));
  const double b = pivot(1, 0) * a;
  const double c = inverse_root(pivot(1, 1) - b * b, original(1, 1));
  Block inverse;
  inverse << a, 0, -b * a * c, c;
  return inverse;
}

}  // namespace

BlockCholesky::BlockCholesky(int n_blocks, const std::vector<std::array<int, 2>>& pairs)
    : place_(n_blocks), diagonal_(n_blocks), inverse_diagonal_(n_blocks) {
  order(pairs);
  store_rows(pairs);
  find_fill();
}

void BlockCholesky::order(const std::vector<std::array<int, 2>>& pairs) {
  std::vector<Eigen::Triplet<char>> entries;
  for (int i = 0; i < n_blocks(); ++i) entries.emplace_back(i, i, 1);
  for (const auto& [i, j] : pairs) {
    entries.emplace_back(i, j, 1);
    entries.emplace_back(j, i, 1);
  }
  Eigen::SparseMatrix<char> graph(n_blocks(), n_blocks());
  graph.setFromTriplets(entries.begin(), entries.end(), [](char, char) { return char{1}; });
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(graph, permutation);
  for (int k = 0; k < n_blocks(); ++k) place_[permutation.indices()[k]] = k;
}

void BlockCholesky::store_rows(const std::vector<std::array<int, 2>>& pairs) {
  std::vector<std::array<int, 2>> entries;  // (row, column), column < row
  for (const auto& [i, j] : pairs) entries.push_back({std::max(place_[i], place_[j]), std::min(place_[i], place_[j])});
  std::vector<std::array<int, 2>> unique = entries;
  std::sort(unique.begin(), unique.end());
  unique.erase(std::unique(unique.begin(), unique.end()), unique.end());

  row_start_.assign(n_blocks() + 1, 0);
  for (const auto& [row, column] : unique) {
    ++row_start_[row + 1];
    row_column_.push_back(column);
  }
  for (int k = 0; k < n_blocks(); ++k) row_start_[k + 1] += row_start_[k];
  off_diagonal_.resize(unique.size());
  for (const auto& entry : entries) {
    const auto slot = std::lower_bound(unique.begin(), unique.end(), entry) - unique.begin();
    springs_.push_back({entry[1], entry[0], static_cast<int>(slot)});
  }
}

// Row k of L is filled where the elimination tree leads from the entries of row k up to k (Liu 1990).
void BlockCholesky::find_fill() {
  const int n = n_blocks();
  std::vector<int> parent(n, -1), seen(n, -1), count(n, 0);
  pattern_start_.assign(1, 0);
  for (int k = 0; k < n; ++k) {
    seen[k] = k;
    for (int p = row_start_[k]; p < row_start_[k + 1]; ++p)
      for (int i = row_column_[p]; seen[i] != k; i = parent[i]) {
        if (parent[i] < 0) parent[i] = k;
        seen[i] = k;
        ++count[i];
        pattern_column_.push_back(i);
      }
    std::sort(pattern_column_.begin() + pattern_start_.back(), pattern_column_.end());
    pattern_start_.push_back(static_cast<int>(pattern_column_.size()));
  }
  column_start_.assign(n + 1, 0);
  for (int i = 0; i < n; ++i) column_start_[i + 1] = column_start_[i] + count[i];
  column_row_.resize(column_start_[n]);
  factor_.resize(column_start_[n]);
  std::vector<int> next(column_start_.begin(), column_start_.end() - 1);
  for (int k = 0; k < n; ++k)
    for (int p = pattern_start_[k]; p < pattern_start_[k + 1]; ++p) column_row_[next[pattern_column_[p]]++] = k;
}

void BlockCholesky::set_zero() {
  std::fill(diagonal_.begin(), diagonal_.end(), Block::Zero());
  std::fill(off_diagonal_.begin(), off_diagonal_.end(), Block::Zero());
}

void BlockCholesky::add_spring(int pair, const Block& stiffness) {
  const Spring& spring = springs_[pair];
  diagonal_[spring.low] += stiffness;
  diagonal_[spring.high] += stiffness;
  off_diagonal_[spring.slot] -= stiffness;
}

void BlockCholesky::add_diagonal(int i, const Block& stiffness) { diagonal_[place_[i]] += stiffness; }

// Up-looking: row k of L solves L[0…k−1] row' = A[0…k−1, k].
void BlockCholesky::factorise(double shift) {
  double mean_diagonal = 0;
  for (const Block& block : diagonal_) mean_diagonal += block.trace() / (2 * n_blocks());
  const Block added = shift * mean_diagonal * Block::Identity();
  std::vector<Block> row(n_blocks(), Block::Zero());
  std::vector<int> end(column_start_.begin(), column_start_.end() - 1);
  for (int k = 0; k < n_blocks(); ++k) {
    for (int p = row_start_[k]; p < row_start_[k + 1]; ++p) row[row_column_[p]] = off_diagonal_[p];
    Block pivot = diagonal_[k] + added;
    for (int p = pattern_start_[k]; p < pattern_start_[k + 1]; ++p) {
      const int i = pattern_column_[p];
      const Block entry = row[i].lazyProduct(inverse_diagonal_[i].transpose());
      row[i].setZero();
      for (int q = column_start_[i]; q < end[i]; ++q) row[column_row_[q]] -= entry.lazyProduct(factor_[q].transpose());
      pivot -= entry.lazyProduct(entry.transpose());
      factor_[end[i]++] = entry;
    }
    inverse_diagonal_[k] = inverse_cholesky(pivot, diagonal_[k] + added);
  }
}

void BlockCholesky::solve(Columns& columns) const {
  const int n = n_blocks();
  Columns x(columns.rows(), columns.cols());
  for (int i = 0; i < n; ++i) x.middleRows<2>(2 * place_[i]) = columns.middleRows<2>(2 * i);
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> current(2, columns.cols());
  for (int j = 0; j < n; ++j) {
    current.noalias() = inverse_diagonal_[j].lazyProduct(x.middleRows<2>(2 * j));
    x.middleRows<2>(2 * j) = current;
    for (int p = column_start_[j]; p < column_start_[j + 1]; ++p)
      x.middleRows<2>(2 * column_row_[p]) -= factor_[p].lazyProduct(current);
  }
  for (int j = n - 1; j >= 0; --j) {
    current = x.middleRows<2>(2 * j);
    for (int p = column_start_[j]; p < column_start_[j + 1]; ++p)
      current -= factor_[p].transpose().lazyProduct(x.middleRows<2>(2 * column_row_[p]));
    x.middleRows<2>(2 * j) = inverse_diagonal_[j].transpose().lazyProduct(current);
  }
  for (int i = 0; i < n; ++i) columns.middleRows<2>(2 * i) = x.middleRows<2>(2 * place_[i]);
}

}  // namespace mbtfm::network
