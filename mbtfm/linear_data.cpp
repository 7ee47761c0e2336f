#include "mbtfm/linear_data.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"

namespace mbtfm::inverse {

LinearData reduce(const DisplacementField& beads, Eigen::MatrixXd compliance_um_per_nN) {
  const Eigen::Index n_rows = 2 * static_cast<Eigen::Index>(beads.size());
  MBTFM_ASSERT(compliance_um_per_nN.rows() == n_rows);
  const bool has_sigmas = std::all_of(beads.begin(), beads.end(), [](const Bead& b) { return b.sigma_um > 0; });
  LinearData data;
  data.has_errors = has_sigmas;
  data.displacement_um.resize(n_rows);
  data.weight_per_um.resize(n_rows);
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const Eigen::Index row = 2 * static_cast<Eigen::Index>(i);
    data.displacement_um.segment<2>(row) << beads[i].displacement_um.x, beads[i].displacement_um.y;
    data.weight_per_um.segment<2>(row).setConstant(has_sigmas ? 1 / beads[i].sigma_um : 1);
  }
  data.compliance_um_per_nN = std::move(compliance_um_per_nN);

  // A = (W G)ᵀ W G = V Λ Vᵀ; then C = Λ^½ Vᵀ and y = Λ^−½ Vᵀ (W G)ᵀ W u. Directions that no bead feels drop out.
  const Eigen::MatrixXd weighted = data.weight_per_um.asDiagonal() * data.compliance_um_per_nN;
  const Eigen::VectorXd weighted_u = data.weight_per_um.cwiseProduct(data.displacement_um);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(weighted.cols(), weighted.cols());
  normal.selfadjointView<Eigen::Lower>().rankUpdate(weighted.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  const double smallest = 1e-13 * eigen.eigenvalues().maxCoeff();  // rounding of the normal matrix
  Eigen::Index n_felt = 0;
  while (n_felt < normal.cols() && eigen.eigenvalues()[normal.cols() - 1 - n_felt] > smallest) ++n_felt;
  const auto roots = eigen.eigenvalues().tail(n_felt).cwiseSqrt();
  const auto vectors = eigen.eigenvectors().rightCols(n_felt);
  data.reduced = roots.asDiagonal() * vectors.transpose();
  data.target = roots.cwiseInverse().asDiagonal() * (vectors.transpose() * (weighted.transpose() * weighted_u));
  data.floor_squared = std::max(0.0, weighted_u.squaredNorm() - data.target.squaredNorm());
  return data;
}

double relative_l2(const LinearData& data, const Eigen::VectorXd& forces_nN) {
  const double scale = data.displacement_um.norm();
  const double misfit = (data.displacement_um - data.compliance_um_per_nN * forces_nN).norm();
  return scale > 0 ? misfit / scale : misfit;
}

}  // namespace mbtfm::inverse
