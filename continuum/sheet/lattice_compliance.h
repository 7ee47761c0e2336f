/// The gel's compliance for thousands of patches: near pairs as such, far ones by a lattice ("precorrected FFT").
#pragma once

#include <Eigen/SparseCore>
#include <array>

#include "continuum/sheet/patches.h"
#include "pipeline/numerics/waves.h"
#include "substrate/compliance.h"

namespace mbtfm::sheet {

/// With P the polynomials that take a lattice's values to the means over patches, K the gel's answer between the
/// lattice's nodes to point forces, and N what is missing for near pairs:
///
///   C = P K Pᵀ + N
///
/// K is a convolution: a product of Fourier transforms on a lattice twice as wide. Only of a gel that answers alike
/// everywhere. Source: Phillips & White, IEEE Trans. CAD 16 (1997) 1059.
class LatticeCompliance final : public PatchCompliance {
 public:
  /// @throws as substrate::Substrate::response
  LatticeCompliance(const Patches& patches, const substrate::Substrate& gel, int threads);
  MatrixXd displace(const MatrixXd& forces_nN) const override;
  VectorXd diagonal_um_per_nN() const override { return diagonal_; }

  const numerics::Lattice& lattice() const { return lattice_; }  ///< without its padding

 private:
  /// K (um/nN) of a point so many columns and rows beside the force, to both sides: xx, xy, yy, row by row.
  struct Kernel {
    int most_columns = 0, most_rows = 0;
    std::array<std::vector<double>, 3> components;
    std::size_t at(int columns, int rows) const {
      return static_cast<std::size_t>(rows + most_rows) * static_cast<std::size_t>(2 * most_columns + 1) +
             static_cast<std::size_t>(columns + most_columns);
    }
  };
  struct Stencil {
    std::vector<std::array<int, 2>> node;  ///< column, row
    std::vector<double> weight;
  };
  Kernel kernel_of(const substrate::Substrate& gel) const;
  Stencil stencil_of(const Patches& patches, int patch) const;
  /// P K Pᵀ of patches by patch j, 2·of × 2.
  static MatrixXd by_lattice(const std::vector<Stencil>& stencils, const std::vector<int>& of, int j,
                             const Kernel& kernel);
  void set_means(const std::vector<Stencil>& stencils);
  void set_waves(const Kernel& kernel);
  void set_near(const Patches& patches, const substrate::Substrate& gel, const std::vector<Stencil>& stencils,
                const Kernel& kernel, int threads);

  numerics::Lattice lattice_;
  int padded_columns_, padded_rows_;
  numerics::WaveTransform transform_;
  std::array<Eigen::ArrayXd, 3> waves_;  ///< K's transform, xx, xy, yy: real, as K is the same to both sides
  Eigen::SparseMatrix<double, Eigen::RowMajor> means_;  ///< P, on the padded lattice
  Eigen::SparseMatrix<double> near_;                    ///< N, lower half
  VectorXd diagonal_;
};

}  // namespace mbtfm::sheet
