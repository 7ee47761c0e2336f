#include "mbtfm/tensions/model_error.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/triangle.h"

namespace mbtfm::tensions {

MeshForces mean_of(const std::vector<MeshForces>& meshes) {
  const auto n = static_cast<double>(meshes.size());
  MeshForces mean{VectorXd::Zero(meshes.front().forces_nN.size()), VectorXd::Zero(meshes.front().forces_nN.size()),
                  MatrixXd::Zero(meshes.front().derivatives.rows(), meshes.front().derivatives.cols())};
  for (const MeshForces& mesh : meshes) {
    mean.forces_nN += mesh.forces_nN / n;
    mean.network_part_nN += mesh.network_part_nN / n;
    mean.derivatives += mesh.derivatives / n;
  }
  return mean;
}

namespace {

/// L_a, once for each component.
VectorXd loads_nN(const MeshForces& mean) {
  constexpr double kOfFibres = 0.05;
  VectorXd loads(mean.forces_nN.size());
  for (Index row = 0; row < loads.size(); row += 2) {
    const Eigen::Vector2d network = mean.network_part_nN.segment<2>(row);
    loads.segment<2>(row).setConstant(network.norm() + kOfFibres * (mean.forces_nN.segment<2>(row) - network).norm());
  }
  return loads;
}

/// Of one further mesh about the mean of these: all adhesions and meshes together tell it.
double least_phi_nN(const std::vector<MeshForces>& meshes, const VectorXd& mean_nN, double sum_of_loads_nN) {
  const auto n = static_cast<double>(meshes.size());
  double squares = 0;
  for (const MeshForces& mesh : meshes) squares += (mesh.forces_nN - mean_nN).squaredNorm();
  return sum_of_loads_nN > 0 ? (1 + 1 / n) * squares / (n - 1) / sum_of_loads_nN : 0;
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
  const VectorXd loads = loads_nN(mean);
  const double least = least_phi_nN(meshes, mean.forces_nN, loads.sum());

  // E |P r|² = s² (rows − tensions) + phi tr(P C diag(L) Cᵀ P), P taking out what the tensions can follow
  const MatrixXd& C = *data.compliance;
  const MatrixXd followed = numerics::orthonormal_basis(displace(data, mean.derivatives));
  const auto left_of = [&](const MatrixXd& columns) {
    return columns.squaredNorm() - numerics::transposed_product(followed, columns).squaredNorm();
  };
  double squares = 0, left_of_squares = 0;
  for (const MeshForces& mesh : meshes) {
    squares += (mesh.forces_nN - mean.forces_nN).squaredNorm();
    left_of_squares += left_of(displace(data, mesh.forces_nN - mean.forces_nN));
  }
  const double left = left_of(numerics::minus_matvec(data.target, C, mean.forces_nN));
  double per_phi = 0;
  constexpr Index kAtOnce = 512;  // columns: a whole is as large as C
  for (Index first = 0; first < C.cols(); first += kAtOnce) {
    const Index count = std::min(kAtOnce, C.cols() - first);
    per_phi += left_of(C.middleCols(first, count) * loads.segment(first, count).cwiseSqrt().asDiagonal());
  }
  const double beyond_noise = left - noise_variance * static_cast<double>(data.n_felt - followed.cols());
  const double measured = per_phi > 0 ? std::max(0.0, beyond_noise / per_phi) : 0;
  // From few adhesions the misfit tells next to nothing of single forces: of twenty numbers a third, of one nothing.
  constexpr Index kEnough = 20;
  const bool is_told = data.n_felt - followed.cols() >= kEnough;
  const double phi = std::max(least, measured);
  return {.phi_nN = phi,
          .least_phi_nN = least,
          .measured_phi_nN = is_told ? measured : least / (1 + static_cast<double>(meshes.size())),
          .phi_of_mean_nN = least / (1 + static_cast<double>(meshes.size())),
          .loads_nN = loads,
          .of_single =
              is_told && left_of_squares > 0 ? std::max(1.0, squares / loads.sum() * per_phi / left_of_squares) : 1,
          .force_variance_nN2 = phi * loads,
          .stated_variance_nN2 = phi * loads,
          .cell_variance_nN2 = measured * loads,
          .noise_variance = noise_variance,
          .is_told = is_told};
}

double lengthened_nN(const VectorXd& forces_nN, const VectorXd& across_nN2) {
  double sum = 0;
  for (Index a = 0; a < across_nN2.size(); ++a) {
    const double force = forces_nN.segment<2>(2 * a).norm();
    sum += std::hypot(force, std::min(std::sqrt(std::max(0.0, across_nN2[a])), force)) - force;  // none turns it round
  }
  return sum;
}

namespace {

/// Of length 1, across the force of adhesion a.
Eigen::Vector2d across(const VectorXd& forces_nN, Index a) {
  const Eigen::Vector2d force = forces_nN.segment<2>(2 * a);
  return Eigen::Vector2d(-force.y(), force.x()) / std::max(force.norm(), 1e-300);
}

}  // namespace

VectorXd across_nN2(const VectorXd& forces_nN, const MatrixXd& covariance) {
  VectorXd variance(forces_nN.size() / 2);
  for (Index a = 0; a < variance.size(); ++a)
    variance[a] = numerics::quadratic_form(covariance.block<2, 2>(2 * a, 2 * a), across(forces_nN, a));
  return variance;
}

RoughnessOfTotal roughness_of_total(const VectorXd& forces_nN, const ModelError& error, const MatrixXd& left) {
  const auto across_by = [&](const VectorXd& variance) {
    VectorXd by_adhesion(variance.size() / 2);
    for (Index a = 0; a < by_adhesion.size(); ++a)
      by_adhesion[a] = left.size() == 0
                           ? variance[2 * a]
                           : (left.middleRows<2>(2 * a).transpose() * across(forces_nN, a)).cwiseAbs2().dot(variance);
    return by_adhesion;
  };
  const VectorXd across_mean = across_by(error.phi_of_mean_nN * error.loads_nN);
  const double of_mean = lengthened_nN(forces_nN, across_mean);
  const double of_cell =
      lengthened_nN(forces_nN, (error.of_single * across_by(error.cell_variance_nN2) - across_mean).cwiseMax(0));
  // The law of the loads holds to a half (model_error.h), for the cell's network and for the mean's.
  const double of_loads = std::hypot(0.5 * of_cell, 0.5 * of_mean);
  // No one knows the cell's links. Of the same beads, networks of 0.9 um find a total that is 1.1 % below that of 1.5
  // um, and any part of that is as likely: its middle is a surplus, and its standard deviation an error. Links along
  // edges, or to the rims of adhesions, make 1.0 % beyond what two networks of a kind differ by (`other_network
  // totals`).
  constexpr double kOfEdge = 0.011, kOfLinks = 0.010;
  const double total = total_nN(forces_nN);
  return {.lacking_nN = of_cell - of_mean,
          .surplus_nN = kOfEdge / 2 * total,
          .sigma_nN = std::hypot(of_loads, kOfEdge / std::sqrt(12.0) * total, kOfLinks * total)};
}

ReducedData whitened(const ReducedData& data, const VectorXd& force_variance, int threads) {
  MBTFM_ASSERT(data.is_upper);
  const MatrixXd& C = *data.compliance;
  MatrixXd root = MatrixXd::Identity(C.rows(), C.rows()), target = data.target;
  numerics::add_triangle_outer(C, force_variance, root, threads);
  const bool is_definite = numerics::upper_root(root, threads);
  MBTFM_ASSERT(is_definite);
  ReducedData white = data;
  numerics::solve_upper(root, target);
  white.target = target;
  numerics::divide_into(C, root, threads);
  white.compliance = std::make_shared<const MatrixXd>(std::move(root));
  return white;
}

}  // namespace mbtfm::tensions
