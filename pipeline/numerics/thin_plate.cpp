#include "pipeline/numerics/thin_plate.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace mbtfm::numerics {

std::optional<std::vector<double>> plate_through(std::vector<double> values, int n_columns, double dx, double dy) {
  std::vector<int> unknown(values.size(), -1);
  int n = 0;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (std::isnan(values[k])) unknown[k] = n++;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  // a second difference that the bending energy counts: places and weights
  const auto bend = [&](std::initializer_list<std::pair<std::size_t, double>> terms) {
    double known = 0;
    for (const auto& [at, weight] : terms) known += unknown[at] < 0 ? weight * values[at] : 0;
    for (const auto& [row, weight] : terms) {
      if (unknown[row] < 0) continue;
      right[unknown[row]] -= weight * known;
      for (const auto& [column, other] : terms)
        if (unknown[column] >= 0) entries.emplace_back(unknown[row], unknown[column], weight * other);
    }
  };
  const auto width = static_cast<std::size_t>(n_columns);
  const double across = 1 / (dx * dx), down = 1 / (dy * dy), twist = std::sqrt(2) / (dx * dy);
  for (std::size_t k = 0; k < values.size(); ++k) {
    const std::size_t i = k % width;
    const bool has_right = i + 1 < width, has_below = k + width < values.size();
    if (i > 0 && has_right) bend({{k - 1, across}, {k, -2 * across}, {k + 1, across}});
    if (k >= width && has_below) bend({{k - width, down}, {k, -2 * down}, {k + width, down}});
    if (has_right && has_below) bend({{k, twist}, {k + 1, -twist}, {k + width, -twist}, {k + width + 1, twist}});
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
  const Eigen::VectorXd filled = factor.solve(right);
  if (factor.info() != Eigen::Success || !filled.allFinite()) return std::nullopt;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (unknown[k] >= 0) values[k] = filled[unknown[k]];
  return values;
}

}  // namespace mbtfm::numerics
