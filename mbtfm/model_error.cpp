#include "mbtfm/model_error.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

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

Eigen::VectorXd variance_between(const std::vector<MeshForces>& meshes, const Eigen::VectorXd& mean_nN) {
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(mean_nN.size());
  for (const MeshForces& mesh : meshes)
    variance += (mesh.forces_nN - mean_nN).cwiseAbs2() / static_cast<double>(meshes.size() - 1);
  for (Eigen::Index i = 0; i < variance.size(); i += 2)
    variance.segment<2>(i).setConstant(variance.segment<2>(i).mean());
  return variance;
}

/// chi² of the residual in units of the errors, once the tensions have followed.
double misfit(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residual, const Eigen::VectorXd& row_scale) {
  const Eigen::MatrixXd J = row_scale.asDiagonal() * jacobian;
  const Eigen::VectorXd r = row_scale.cwiseProduct(residual);
  return (r - J * J.colPivHouseholderQr().solve(r)).squaredNorm();
}

}  // namespace

ModelError model_error(const std::vector<MeshForces>& meshes, const ReducedData& data, double beads_variance) {
  MBTFM_ASSERT(meshes.size() >= 3);
  // Simulated beads may be exact; but neither a tracked bead nor the model of a gel is right to a thousandth of what
  // beads move on average. Below that, all weight would be on the few modes that no mesh happens to disagree upon.
  constexpr double kLeastShare = 1e-3;
  const double mean_square = (data.target.squaredNorm() + data.floor_squared) / static_cast<double>(data.n_components);
  const double noise_variance = std::max(beads_variance, kLeastShare * kLeastShare * mean_square);
  const MeshForces mean = mean_of(meshes);
  const Eigen::VectorXd variance = variance_between(meshes, mean.forces_nN);
  // C V Cᵀ = U diag(sizes) Uᵀ: in the coordinates Uᵀ y the errors of the rows are independent for every kappa
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(data.compliance * variance.asDiagonal() *
                                                             data.compliance.transpose());
  const Eigen::VectorXd sizes = modes.eigenvalues().cwiseMax(0);  // rounding may leave some below
  const Eigen::MatrixXd C = modes.eigenvectors().transpose() * data.compliance;
  const Eigen::VectorXd y = modes.eigenvectors().transpose() * data.target;
  const Eigen::MatrixXd J = C * mean.derivatives;
  const Eigen::VectorXd residual = y - C * mean.forces_nN;
  const double expected = noise_variance * static_cast<double>(std::max<Eigen::Index>(1, J.rows() - J.cols()));
  const auto noise_share = [&](double kappa) -> Eigen::VectorXd {
    return (1 + kappa / noise_variance * sizes.array()).inverse();
  };

  constexpr double kLargest = 1e4;  // the meshes' spread would be a hundredth of the model's error: it tells nothing
  const double least = 1 + 1 / static_cast<double>(meshes.size());
  double low = least, high = least;
  const auto is_too_small = [&](double kappa) {
    return misfit(J, residual, noise_share(kappa).cwiseSqrt()) > expected;
  };
  while (high < kLargest && is_too_small(high)) {
    low = high;
    high *= 4;
  }
  while (high > 1.01 * low) {
    const double middle = std::sqrt(low * high);
    (is_too_small(middle) ? low : high) = middle;
  }

  ModelError error{.force_variance_nN2 = high * variance,
                   .kappa = high,
                   .least_kappa = least,
                   .noise_variance = noise_variance,
                   .data = data,
                   .noise_share = {}};
  error.noise_share = noise_share(high);
  const Eigen::VectorXd scale = error.noise_share.cwiseSqrt();
  error.data.compliance = scale.asDiagonal() * C;
  error.data.target = scale.cwiseProduct(y);
  return error;
}

}  // namespace mbtfm::inverse
