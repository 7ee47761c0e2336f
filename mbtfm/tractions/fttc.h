/// Fourier transform traction cytometry on scattered beads, regularised.
#pragma once

#include <vector>

#include "mbtfm/inverse/regularisation.h"
#include "mbtfm/tractions/lattice_problem.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tractions {

// The criteria are flat where they are best: a hundredth of the tractions, in energy, moves none of them.
inline constexpr double kScanTolerance = 1e-2;
inline constexpr double kTolerance = 1e-3;  ///< in energy: far below any error bar

/// That this problem can distinguish, falling.
std::vector<double> lambdas_of(const LatticeProblem& problem);

/// The criteria over the lambdas that this problem can distinguish. @param solver  of the problem's data: left near one
LambdaScan scan_lambda(const LatticeProblem& problem, TikhonovSolver& solver);

LatticeOptions lattice_options(const TractionParameters& parameters, int threads);

/// Vectors at the nodes of the field, rows first.
std::vector<Vec2> on_field(const LatticeProblem& problem, const NodeField& nodes);
/// @param tractions_kPa  at these  @param displacements  of the box
std::vector<GroundPatch> patches_of(const LatticeProblem& problem, const std::vector<Vec2>& tractions_kPa,
                                    const NodeField& displacements);

/// Forces by adhesion, in addition to the tractions of a lattice: docs/theory/reconstructions.md (16).
/// The beads' displacements (times the roots of their weights) come from forces F on the adhesions, from tractions
/// without a pattern everywhere, and from noise:
///
///   u = D F + P G t + noise,   noise ~ sigma²,   t ~ sigma² / m²,   F ~ s²
///
/// the first two variances being those that make (9) with lambda = m the best guess of t. With
/// W = D − P G (A + m²)⁻¹ G Pᵀ D, A = G PᵀP G, what is known of F has the covariance and the mean
///
///   C = (Wᵀ D / sigma² + 1 / s²)⁻¹,   F = C Wᵀ u / sigma²
///
/// (Lindley & Smith, J. R. Stat. Soc. B 34 (1972) 1). m and s are the most likely ones for u: where forces on the
/// adhesions explain all, there is no background, and where the adhesions do not explain the beads, it is strong.
/// @param scan     of the same problem
/// @param patches  of the map, whose moments stay
std::vector<AdhesionForce> forces_beside(const LatticeProblem& problem, const LambdaScan& scan,
                                         const std::vector<GroundPatch>& patches, const TractionInputs& inputs,
                                         const TractionParameters& parameters, int threads);

/// Standard errors of the map along x and y, by node of the field: noise and what the penalty takes, from tractions
/// drawn as large as those of evidence are around each node, that the same equation finds again from their noisy
/// displacements. docs/theory/reconstructions.md (19). Each is known to some 6 %.
std::vector<Vec2> drawn_errors_kPa(const LatticeProblem& problem, const LambdaScan& scan, double lambda,
                                   const TractionParameters& parameters, int threads);

/// Where all displacements are zero: no tractions, and a remark that says so.
Reconstruction reconstruction_of_nothing(const LatticeProblem& problem, const TractionInputs& inputs);

WaveField smoothed(const LatticeProblem& problem, WaveField waves, ReadOut read_out, double gaussian_um);
/// Waves of traction to vectors at the nodes of the field, rows first. @param gaussian_um  smooths them; 0: not
std::vector<Vec2> tractions_kPa(const LatticeProblem& problem, const WaveField& waves, ReadOut read_out,
                                double gaussian_um);

// Normal equations of forces together with tractions everywhere, for every weight of these at once.

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
