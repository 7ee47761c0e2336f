#include "pipeline/numerics/spring_matrix.h"

#include <algorithm>

#include "pipeline/numerics/dense_panel.h"

namespace mbtfm::numerics {

BlockMatrix<2> matrix_of_pairs(int n_blocks, const std::vector<std::array<int, 2>>& pairs) {
  std::vector<std::vector<int>> rows(n_blocks);
  for (const auto& [i, j] : pairs) rows[std::min(i, j)].push_back(std::max(i, j));
  BlockMatrix<2> matrix;
  matrix.n = n_blocks;
  matrix.start = {0};
  for (int column = 0; column < n_blocks; ++column) {
    std::vector<int>& below = rows[column];
    std::ranges::sort(below);
    below.erase(std::unique(below.begin(), below.end()), below.end());
    matrix.row.push_back(column);
    matrix.row.insert(matrix.row.end(), below.begin(), below.end());
    matrix.start.push_back(static_cast<int>(matrix.row.size()));
  }
  matrix.value.assign(4 * matrix.row.size(), 0);
  return matrix;
}

SpringMatrix::SpringMatrix(int n_blocks, const std::vector<std::array<int, 2>>& pairs)
    : matrix_(matrix_of_pairs(n_blocks, pairs)),
      factor_(std::make_shared<const Elimination>(matrix_, Search::thorough)) {
  for (const auto& [i, j] : pairs)
    springs_.push_back({matrix_.start[i], matrix_.start[j], matrix_.slot(std::max(i, j), std::min(i, j))});
}

void SpringMatrix::set_zero() { std::fill(matrix_.value.begin(), matrix_.value.end(), 0.0); }

void SpringMatrix::add_spring(int pair, const Block& stiffness) {
  const Spring& spring = springs_[pair];
  block(spring.low) += stiffness;
  block(spring.high) += stiffness;
  block(spring.between) -= stiffness;
}

void SpringMatrix::add_diagonal(int i, const Block& stiffness) { block(matrix_.start[i]) += stiffness; }

void SpringMatrix::factorise(double shift) {
  double mean_diagonal = 0;
  for (int i = 0; i < n_blocks(); ++i) mean_diagonal += block(matrix_.start[i]).trace() / (2 * n_blocks());
  factor_.factorise(matrix_, {.lost_pivot = LostPivot::holds_still, .shift = shift * mean_diagonal});
}

void SpringMatrix::solve(Columns& columns) const {
  const auto n_columns = static_cast<std::size_t>(columns.cols());
  constexpr std::size_t kAtATime = kRightHandSides<double>;
  const std::size_t n = n_columns == 1 ? 1 : (n_columns + kAtATime - 1) / kAtATime * kAtATime;
  Columns in_order = Columns::Zero(columns.rows(), static_cast<Eigen::Index>(n));  // of elimination
  const std::vector<int>& place = factor_.elimination().place;
  for (int i = 0; i < n_blocks(); ++i)
    in_order.middleRows<2>(2 * place[i]).leftCols(columns.cols()) = columns.middleRows<2>(2 * i);
  factor_.solve(in_order.data(), n);
  for (int i = 0; i < n_blocks(); ++i)
    columns.middleRows<2>(2 * i) = in_order.middleRows<2>(2 * place[i]).leftCols(columns.cols());
}

}  // namespace mbtfm::numerics
