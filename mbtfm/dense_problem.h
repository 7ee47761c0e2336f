/// Displacements as the answer to a few hundred loads, regularised: for point forces and boundary elements.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "mbtfm/regularisation.h"
#include "pipeline/contract/types.h"

namespace mbtfm::inverse {

/// Columns 2j, 2j+1: displacement (um) by load j along x, y; rows 2i, 2i+1: at point i.
using Compliance = std::function<Eigen::MatrixXd(const std::vector<Vec2>& points_um)>;

/// |G f − u|² + lambda² |f|², each bead weighted by its 1/sigma², of mean one.
class DenseProblem {
 public:
  /// @throws InvalidData where there are fewer displacement components than loads
  DenseProblem(const DisplacementField& beads, Compliance compliance, Eigen::Index n_loads);

  LambdaScan scan() const;
  Eigen::VectorXd solve(double lambda) const;
  /// Of solve(lambda), by the noise alone. @param variance  of one component of unit weight
  Eigen::MatrixXd covariance(double lambda, double variance) const;
  double relative_l2(const Eigen::VectorXd& loads) const;
  double data_squared() const { return data_squared_; }

 private:
  template <class Use>
  void for_blocks(const Use& use) const;  ///< use(weighted block of G, weighted u of the same rows)
  const DisplacementField& beads_;
  Compliance compliance_;
  std::vector<double> weights_;
  std::optional<double> stated_variance_;
  double data_squared_ = 0;
  Eigen::VectorXd eigenvalues_, projected_;  ///< of GᵀG; its eigenvectors' share in Gᵀ u
  Eigen::MatrixXd eigenvectors_;
};

}  // namespace mbtfm::inverse
