/// The stiffness of a sheet's nodes, 2 × 2 blocks, and its factor. The pattern stays while values change.
#pragma once

#include <vector>

#include "continuum/sheet/sheet.h"
#include "pipeline/numerics/block_cholesky.h"

namespace mbtfm::sheet {

class Stiffness {
 public:
  using OfElement = Eigen::Matrix<double, 12, 12>;

  /// @param held  by node, along x and y: these do not move; empty: none
  Stiffness(const Elements& elements, std::vector<std::array<bool, 2>> held);

  void set_zero();
  void add(int triangle, const OfElement& stiffness);
  /// @returns whether it is positive definite. @param shift  times the mean diagonal, added to the diagonal
  bool factorise(double shift = 0, int threads = 1);
  /// With the last factor; what is held stays. @param forces_nN  2·nodes × any number
  MatrixXd solve(const MatrixXd& forces_nN) const;

 private:
  double mean_diagonal() const;
  const Elements& elements_;
  std::vector<std::array<bool, 2>> held_;
  numerics::BlockMatrix<2> matrix_;
  std::vector<std::array<int, 21>> slots_;  ///< by triangle: of its pairs i >= j
  numerics::BlockCholesky<2, double> factor_;
};

/// ∫ Bᵀ C B of a triangle at rest.
Stiffness::OfElement elastic_stiffness(const Elements& elements, int triangle, const Material& material);
/// ∫ κ N N. @param by_point  kPoints values
Stiffness::OfElement spring_stiffness(const Elements& elements, int triangle, const double* by_point);

/// Three components that keep a free sheet from moving as a whole: both of a node, and the one across to it of the node
/// furthest away. Balanced forces leave them without a reaction.
std::vector<std::array<bool, 2>> pins(const Elements& elements);

}  // namespace mbtfm::sheet
