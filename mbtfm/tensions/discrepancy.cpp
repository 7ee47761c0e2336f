#include "mbtfm/tensions/discrepancy.h"

#include <algorithm>

#include "mbtfm/tensions/robust.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tensions {

namespace {

constexpr double kDegrees = 4;  // ν

/// By force: the sums that are zero if all forces together balance; 2·adhesions × 3, or × 0.
MatrixXd sums_in_balance(const std::vector<Vec2>& centres_um) {
  MatrixXd sums(2 * std::ssize(centres_um), centres_um.empty() ? 0 : 3);
  Vec2 middle;
  for (const Vec2 c : centres_um) middle += (1.0 / static_cast<double>(centres_um.size())) * c;
  for (std::size_t a = 0; a < centres_um.size(); ++a) {
    const Vec2 arm = centres_um[a] - middle;
    sums.middleRows<2>(2 * static_cast<Index>(a)) << 1, 0, -arm.y, 0, 1, arm.x;
  }
  return sums;
}

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

VectorXd by_component(const VectorXd& by_adhesion) {
  VectorXd twice(2 * by_adhesion.size());
  for (Index a = 0; a < by_adhesion.size(); ++a) twice.segment<2>(2 * a).setConstant(by_adhesion[a]);
  return twice;
}

/// An adhesion that nothing pulls at by this model may still bear something.
VectorXd not_without(const VectorXd& loads_nN) { return loads_nN.cwiseMax(1e-3 * loads_nN.mean()).cwiseMax(1e-300); }

}  // namespace

Discrepancy discrepancy_of(const ReducedData& data, const MeshForces& mean, const VectorXd& tensions_nN,
                           const ModelError& error, const std::vector<Vec2>& centres_um, int threads) {
  const double variance = error.noise_variance;
  const MatrixXd C = displace(data, MatrixXd::Identity(data.compliance->cols(), data.compliance->cols()), threads);
  const MatrixXd J = of_free_tensions(mean.derivatives, tensions_nN), A = displace(data, J),
                 Q = numerics::orthonormal_basis(A);
  Beyond beyond{
      .compliance = C - numerics::product(Q, numerics::transposed_product(Q, C, threads), threads), .H = {}, .q = {}};
  beyond.H = numerics::gram(beyond.compliance, threads) / variance;
  beyond.q =
      numerics::transposed_matvec(beyond.compliance, numerics::minus_matvec(data.target, C, mean.forces_nN)) / variance;
  const MatrixXd sums = sums_in_balance(centres_um);
  const VectorXd loads = not_without(error.loads_nN);
  const Index n = loads.size() / 2;
  const VectorXd load = Eigen::Map<const VectorXd, 0, Eigen::InnerStride<2>>(loads.data(), n);

  // The scale converges slowly where one adhesion deviates far more than the others; forces do not change by then.
  const int n_rounds = C.cols() <= 1000 ? 10 : 4;
  Discrepancy found{
      .share_nN = {}, .scale_nN = std::max(error.measured_phi_nN, 0.05 * error.least_phi_nN), .forces = {}};
  found.share_nN = VectorXd::Constant(n, found.scale_nN);
  const auto posterior = [&] {
    return Posterior(beyond, by_component(found.share_nN).cwiseProduct(loads), sums, threads);
  };
  for (int round = 0; round < n_rounds; ++round) {
    const Posterior of_e = posterior();
    const VectorXd squares = of_e.times(beyond.q).col(0).cwiseAbs2() + of_e.diagonal();
    for (Index a = 0; a < n; ++a)
      found.share_nN[a] = (kDegrees * found.scale_nN + squares.segment<2>(2 * a).sum() / load[a]) / (kDegrees + 2);
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
  error.cell_variance_nN2 = by_component(found.share_nN).cwiseProduct(error.loads_nN);
  error.stated_variance_nN2 = error.force_variance_nN2.cwiseMax(error.cell_variance_nN2);
  return error;
}

}  // namespace mbtfm::tensions
