/// Symmetric matrices within a band, and what of their inverse lies within it.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace mbtfm::surface {

/// Column j holds rows j to j + width.
struct Band {
  Band(int order, int half_width)
      : n(order), width(half_width), values(static_cast<std::size_t>(order) * (half_width + 1), 0) {}

  double& at(int row, int column) { return values[place(row, column)]; }
  double at(int row, int column) const { return values[place(row, column)]; }
  double symmetric(int a, int b) const { return a > b ? at(a, b) : at(b, a); }
  /// On and below the diagonal.
  Eigen::Map<const Eigen::VectorXd> column(int j) const { return {&values[place(j, j)], 1 + below(j)}; }
  int below(int j) const { return std::min(width, n - 1 - j); }
  Eigen::VectorXd times(const Eigen::VectorXd& x) const;

  int n, width;
  std::vector<double> values;

 private:
  std::size_t place(int row, int column) const {
    return static_cast<std::size_t>(column) * (width + 1) + (row - column);
  }
};

/// L of L Lᵀ, in place. @return false where the matrix is not positive definite
bool factorise(Band& matrix);
/// x of L Lᵀ x = b
Eigen::VectorXd solve(const Band& factor, Eigen::VectorXd b);
/// Entries of (L Lᵀ)⁻¹ within the band. Source: Takahashi, Fagan, Chen (1973); Rue, Martino, Chopin, JRSS B 71 (2009)
/// 319.
Band inverse_within(const Band& factor);

}  // namespace mbtfm::surface
