#include "mbtfm/model_error.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

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
  const Eigen::MatrixXd& C = *data.compliance;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(displace(data, mean.derivatives));
  const Eigen::MatrixXd followed = qr.householderQ() * Eigen::MatrixXd::Identity(C.rows(), qr.rank());
  const auto left_of = [&](const Eigen::MatrixXd& columns) {
    return columns.squaredNorm() - transposed_product(followed, columns).squaredNorm();
  };
  const double left = left_of(data.target - C * mean.forces_nN);
  const double per_phi = left_of(C * sizes.cwiseSqrt().asDiagonal());
  const double beyond_noise = left - noise_variance * static_cast<double>(data.n_felt - qr.rank());
  const double phi = std::max(least, per_phi > 0 ? beyond_noise / per_phi : 0);
  return {.phi_nN = phi, .least_phi_nN = least, .force_variance_nN2 = phi * sizes, .noise_variance = noise_variance};
}

ReducedData whitened(const ReducedData& data, const ModelError& error, int threads) {
  Eigen::MatrixXd C = *data.compliance * (error.force_variance_nN2 / error.noise_variance).cwiseSqrt().asDiagonal();
  Eigen::MatrixXd relative = Eigen::MatrixXd::Identity(C.rows(), C.rows()), target = data.target;
  add_upper_outer(C, relative, threads);
  C = *data.compliance;
  const bool is_definite = upper_cholesky(relative, threads);
  MBTFM_ASSERT(is_definite);
  solve_upper_transposed(relative, C, threads);
  solve_upper_transposed(relative, target);
  ReducedData white = data;
  white.is_upper = false;
  white.compliance = std::make_shared<const Eigen::MatrixXd>(std::move(C));
  white.target = target;
  return white;
}

}  // namespace mbtfm::inverse
