/// Normal equations of forces beside tractions everywhere, for every weight of these at once.
#pragma once

#include <vector>

#include "mbtfm/tractions/lattice_problem.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tractions {

/// With Y = [D u] and S = P G G Pᵀ, one block recurrence from Y brings S to a block tridiagonal matrix, A_j on its
/// diagonal and B_j below. Then, for any m,
///
///   Yᵀ (1 + S / m²)⁻¹ Y = Rᵀ M_1⁻¹ R,   M_j = 1 + A_j / m² − B_jᵀ M_{j+1}⁻¹ B_j / m⁴
///
/// with R from Y = Q_1 R. Source: block Lanczos and Gauss quadrature (Golub & Meurant, Matrices, Moments and Quadrature
/// with Applications, 2010).
class BesideBackground {
 public:
  /// @param D  weighted components by a force on each adhesion: 2·beads × any number
  BesideBackground(const LatticeProblem& problem, const MatrixXd& D, int threads);

  /// Of (16): Wᵀ D and Wᵀ u.
  struct Normal {
    MatrixXd matrix;
    VectorXd right;
  };
  /// Adds blocks until they change it no more.
  Normal at(double m);

 private:
  bool is_complete() const { return basis_.cols() == 0; }
  MatrixXd times_S(const MatrixXd& columns) const;
  void add_block();
  MatrixXd product_at(double m, std::size_t n_blocks) const;
  const LatticeProblem& problem_;
  int threads_;
  MatrixXd start_;                          ///< R
  MatrixXd before_, basis_;                 ///< Q of the last block, and of the one to come
  std::vector<MatrixXd> diagonal_, below_;  ///< A_j, B_j
};

}  // namespace mbtfm::tractions
