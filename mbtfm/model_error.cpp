#include "mbtfm/model_error.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>

#include "pipeline/contract/errors.h"

namespace mbtfm::inverse {

namespace {

MeshForces mean_of(const std::vector<MeshForces>& meshes) {
  const auto n = static_cast<double>(meshes.size());
  MeshForces mean{Eigen::VectorXd::Zero(meshes.front().forces_nN.size()),
                  Eigen::MatrixXd::Zero(meshes.front().derivatives.rows(), meshes.front().derivatives.cols())};
  for (const MeshForces& mesh : meshes) {
    mean.forces_nN += mesh.forces_nN / n;
    mean.derivatives += mesh.derivatives / n;
  }
  return mean;
}

/// |R_a|, once for each component.
Eigen::VectorXd sizes_nN(const Eigen::VectorXd& forces_nN) {
  Eigen::VectorXd sizes(forces_nN.size());
  for (Eigen::Index row = 0; row < sizes.size(); row += 2)
    sizes.segment<2>(row).setConstant(forces_nN.segment<2>(row).norm());
  return sizes;
}

/// Of one further mesh about the mean of these: all adhesions and meshes together tell it.
double least_phi_nN(const std::vector<MeshForces>& meshes, const Eigen::VectorXd& mean_nN, double sum_of_sizes_nN) {
  const auto n = static_cast<double>(meshes.size());
  double squares = 0;
  for (const MeshForces& mesh : meshes) squares += (mesh.forces_nN - mean_nN).squaredNorm();
  return sum_of_sizes_nN > 0 ? (1 + 1 / n) * squares / (n - 1) / sum_of_sizes_nN : 0;
}

}  // namespace

ModelError model_error(const std::vector<MeshForces>& meshes, const ReducedData& data, double beads_variance) {
  MBTFM_ASSERT(meshes.size() >= 2);
  // Simulated beads may be exact; but neither a tracked bead nor the model of a gel is right to a thousandth of what
  // beads move on average.
  constexpr double kLeastShare = 1e-3;
  const double mean_square = (data.target.squaredNorm() + data.floor_squared) / static_cast<double>(data.n_components);
  const double noise_variance = std::max(beads_variance, kLeastShare * kLeastShare * mean_square);
  const MeshForces mean = mean_of(meshes);
  const Eigen::VectorXd sizes = sizes_nN(mean.forces_nN);
  const double least = least_phi_nN(meshes, mean.forces_nN, sizes.sum());

  // E |P r|² = s² (rows − tensions) + phi tr(P C diag(sizes) Cᵀ P), P taking out what the tensions can follow
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(data.compliance * mean.derivatives);
  const auto projected = [&](const Eigen::MatrixXd& columns) -> Eigen::MatrixXd {
    const Eigen::MatrixXd turned = qr.householderQ().adjoint() * columns;
    return turned.bottomRows(turned.rows() - qr.rank());
  };
  const Eigen::MatrixXd left = projected(data.target - data.compliance * mean.forces_nN);
  const double per_phi = projected(data.compliance * sizes.cwiseSqrt().asDiagonal()).squaredNorm();
  const double beyond_noise = left.squaredNorm() - noise_variance * static_cast<double>(left.rows());
  const double phi = std::max(least, per_phi > 0 ? beyond_noise / per_phi : 0);
  return {.phi_nN = phi, .least_phi_nN = least, .force_variance_nN2 = phi * sizes, .noise_variance = noise_variance};
}

ReducedData whitened(const ReducedData& data, const ModelError& error) {
  const Eigen::MatrixXd& C = data.compliance;
  Eigen::MatrixXd relative = C * (error.force_variance_nN2 / error.noise_variance).asDiagonal() * C.transpose();
  relative.diagonal().array() += 1;
  const Eigen::LLT<Eigen::MatrixXd> root(relative);
  ReducedData white = data;
  white.compliance = root.matrixL().solve(C);
  white.target = root.matrixL().solve(data.target);
  return white;
}

}  // namespace mbtfm::inverse
