#include "mbtfm/tensions/model_error.h"

#include <algorithm>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/robust.h"
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
VectorXd loads_nN(const MeshForces& mean, Index dimension) {
  constexpr double kOfFibres = 0.05;
  VectorXd loads(mean.forces_nN.size());
  for (Index row = 0; row < loads.size(); row += dimension) {
    const auto network = mean.network_part_nN.segment(row, dimension), force = mean.forces_nN.segment(row, dimension);
    loads.segment(row, dimension).setConstant(network.norm() + kOfFibres * (force - network).norm());
  }
  return loads;
}

/// Of one further mesh about the mean of these: all adhesions and meshes together determine it.
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
  const VectorXd loads = loads_nN(mean, data.dimension);
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
  // From few adhesions the misfit shows next to nothing of single forces: of twenty numbers a third, of one nothing.
  constexpr Index kEnough = 20;
  const bool is_known = data.n_felt - followed.cols() >= kEnough;
  const double phi = std::max(least, measured);
  return {.least_phi_nN = least,
          .measured_phi_nN = is_known ? measured : least / (1 + static_cast<double>(meshes.size())),
          .phi_of_mean_nN = least / (1 + static_cast<double>(meshes.size())),
          .loads_nN = loads,
          .of_single =
              is_known && left_of_squares > 0 ? std::max(1.0, squares / loads.sum() * per_phi / left_of_squares) : 1,
          .force_variance_nN2 = phi * loads,
          .stated_variance_nN2 = phi * loads,
          .cell_variance_nN2 = measured * loads,
          .noise_variance = noise_variance,
          .is_known = is_known,
          .dimension = data.dimension};
}

double lengthened_nN(const VectorXd& forces_nN, const VectorXd& across_nN2) {
  double sum = 0;
  const Index dimension = forces_nN.size() / std::max<Index>(1, across_nN2.size());
  for (Index a = 0; a < across_nN2.size(); ++a) {
    const double force = forces_nN.segment(dimension * a, dimension).norm();
    sum += std::hypot(force, std::min(std::sqrt(std::max(0.0, across_nN2[a])), force)) - force;  // none turns it round
  }
  return sum;
}

VectorXd across_nN2(const VectorXd& forces_nN, const MatrixXd& covariance, Index dimension) {
  VectorXd variance(forces_nN.size() / dimension);
  for (Index a = 0; a < variance.size(); ++a)
    variance[a] = numerics::quadratic_forms(covariance.block(dimension * a, dimension * a, dimension, dimension),
                                            numerics::across(forces_nN.segment(dimension * a, dimension)))
                      .sum();
  return variance;
}

RoughnessOfTotal roughness_of_total(const VectorXd& forces_nN, const ModelError& error, const MatrixXd& left) {
  const Index dimension = error.dimension;
  const auto across_by = [&](const VectorXd& variance) {
    VectorXd by_adhesion(variance.size() / dimension);
    for (Index a = 0; a < by_adhesion.size(); ++a) {
      const MatrixXd aside = numerics::across(forces_nN.segment(dimension * a, dimension)).transpose();
      by_adhesion[a] =
          left.size() == 0
              ? variance[dimension * a] * static_cast<double>(aside.rows())
              : (aside * left.middleRows(dimension * a, dimension)).cwiseAbs2().colwise().sum().dot(variance);
    }
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
  const double total = total_nN(forces_nN, dimension);
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

namespace {

constexpr double kDegrees = 4;  // ν

/// What the tensions that are free cannot follow.
struct Beyond {
  MatrixXd compliance;  ///< P C, P = 1 − A (AᵀA)⁻¹ Aᵀ
  MatrixXd H;           ///< Cᵀ P C / s²
  VectorXd q;           ///< Cᵀ P r / s²
};

/// Of e given the data, for these variances by force: (H + diag(1/v))⁻¹, less what the balance takes.
class Posterior {
 public:
  Posterior(const Beyond& beyond, const VectorXd& variance, const MatrixXd& sums, int threads)
      : root_(beyond.H), sums_(sums) {
    root_.diagonal() += variance.cwiseInverse();
    numerics::upper_cholesky(root_, threads);  // H is a Gram matrix
    if (sums_.cols() == 0) return;
    answers_ = inverse_times(sums_);
    gain_ = numerics::solve_symmetric(numerics::small_transposed_product(sums_, answers_), answers_.transpose());
  }
  MatrixXd times(const MatrixXd& X) const {
    MatrixXd result = inverse_times(X);
    if (sums_.cols() > 0)
      result -= numerics::small_product(gain_.transpose(), numerics::small_transposed_product(sums_, result));
    return result;
  }
  VectorXd diagonal() const {
    MatrixXd inverse = MatrixXd::Identity(root_.rows(), root_.cols());
    numerics::solve_upper_transposed(root_, inverse);
    VectorXd diagonal = inverse.colwise().squaredNorm();
    if (sums_.cols() > 0) diagonal -= answers_.cwiseProduct(gain_.transpose()).rowwise().sum();
    return diagonal;
  }

 private:
  MatrixXd inverse_times(MatrixXd X) const {
    numerics::solve_upper_transposed(root_, X);
    numerics::solve_upper(root_, X);
    return X;
  }
  MatrixXd root_, sums_, answers_, gain_;
};

VectorXd by_component(const VectorXd& by_adhesion, Index dimension) {
  return by_adhesion.transpose().replicate(dimension, 1).reshaped();
}

/// An adhesion that nothing pulls at by this model may still carry something.
VectorXd not_without(const VectorXd& loads_nN) { return loads_nN.cwiseMax(1e-3 * loads_nN.mean()).cwiseMax(1e-300); }

}  // namespace

MatrixXd balance_of(const std::vector<Vec2>& places_um) {
  MatrixXd sums(2 * std::ssize(places_um), 3);
  const Vec2 middle = centre_of(places_um);
  for (std::size_t a = 0; a < places_um.size(); ++a) {
    const Vec2 arm = places_um[a] - middle;
    sums.middleRows<2>(2 * static_cast<Index>(a)) << 1, 0, -arm.y, 0, 1, arm.x;
  }
  return sums;
}

Discrepancy discrepancy_of(const ReducedData& data, const MeshForces& mean, const VectorXd& tensions_nN,
                           const ModelError& error, const MatrixXd& balance, int threads) {
  const double variance = error.noise_variance;
  const MatrixXd C = displace(data, MatrixXd::Identity(data.compliance->cols(), data.compliance->cols()), threads);
  const MatrixXd J = of_free_tensions(mean.derivatives, tensions_nN), A = displace(data, J),
                 Q = numerics::orthonormal_basis(A);
  Beyond beyond{
      .compliance = C - numerics::product(Q, numerics::transposed_product(Q, C, threads), threads), .H = {}, .q = {}};
  beyond.H = numerics::gram(beyond.compliance, threads) / variance;
  beyond.q =
      numerics::transposed_matvec(beyond.compliance, numerics::minus_matvec(data.target, C, mean.forces_nN)) / variance;
  const VectorXd loads = not_without(error.loads_nN);
  const Index dimension = data.dimension, n = loads.size() / dimension;

  // The scale converges slowly where one adhesion deviates far more than the others; forces do not change by then.
  const int n_rounds = C.cols() <= 1000 ? 10 : 4;
  Discrepancy found{
      .share_nN = {}, .scale_nN = std::max(error.measured_phi_nN, 0.05 * error.least_phi_nN), .forces = {}};
  found.share_nN = VectorXd::Constant(n, found.scale_nN);
  const auto posterior = [&] {
    return Posterior(beyond, by_component(found.share_nN, dimension).cwiseProduct(loads), balance, threads);
  };
  for (int round = 0; round < n_rounds; ++round) {
    const Posterior of_e = posterior();
    const VectorXd squares = of_e.times(beyond.q).col(0).cwiseAbs2() + of_e.diagonal();
    for (Index a = 0; a < n; ++a) {
      const double of_one = squares.segment(dimension * a, dimension).sum() / loads[dimension * a];
      found.share_nN[a] = (kDegrees * found.scale_nN + of_one) / (kDegrees + static_cast<double>(dimension));
    }
    found.scale_nN = static_cast<double>(n) / found.share_nN.cwiseInverse().sum();
  }
  // e, and what the tensions add as they follow what e leaves: A⁺ (r − C e)
  const MatrixXd of_e = posterior().times(beyond.compliance.transpose()) / variance;
  MatrixXd left = -numerics::product(C, of_e, threads);
  left.diagonal().array() += 1;
  const MatrixXd follow = numerics::small_product(J, numerics::shortest_solution(A, left));
  const MatrixXd gain = of_e + follow;
  found.forces.left = -numerics::product(gain, C, threads);
  found.forces.left.diagonal().array() += 1;
  found.forces.found_nN = numerics::matvec(gain, data.target);
  found.forces.covariance = numerics::product(gain, gain.transpose(), threads);
  return found;
}

ModelError with_discrepancy(ModelError error, const Discrepancy& found) {
  error.cell_variance_nN2 = by_component(found.share_nN, error.dimension).cwiseProduct(error.loads_nN);
  error.stated_variance_nN2 = error.force_variance_nN2.cwiseMax(error.cell_variance_nN2);
  return error;
}

}  // namespace mbtfm::tensions
