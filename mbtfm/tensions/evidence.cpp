#include "mbtfm/tensions/evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/numerics/dense.h"

namespace mbtfm::tensions {

namespace {

/// −2 ln of the density of what each model leaves, but for what all have in common, with this τ².
/// @param gram  CᵀC / s²
/// @param pulled  Cᵀ r / s², by column
/// @param chi_squared  r·r / s² and the squares that no forces explain
VectorXd minus_two_logs(const MatrixXd& gram, const MatrixXd& pulled, const VectorXd& chi_squared, double tau_squared,
                        int threads) {
  if (tau_squared == 0) return chi_squared;
  // r (s² + τ² C Cᵀ)⁻¹ r by Woodbury's identity, and the determinant by Sylvester's
  MatrixXd root = tau_squared * gram;
  root.diagonal().array() += 1;
  numerics::upper_cholesky(root, threads);
  MatrixXd whitened = pulled;
  numerics::solve_upper_transposed(root, whitened, threads);
  const double log_determinant = 2 * root.diagonal().array().log().sum();
  return chi_squared.array() - tau_squared * whitened.colwise().squaredNorm().transpose().array() + log_determinant;
}

}  // namespace

void weigh_with_discrepancy(std::vector<ModelScore>& models, const LinearData& data) {
  const MatrixXd& C = *data.reduced.compliance;
  const double variance = noise_variance(data);
  MatrixXd pulled(C.cols(), std::ssize(models));
  VectorXd chi_squared(std::ssize(models));
  for (Index m = 0; m < std::ssize(models); ++m) {
    const bool is_free = models[m].left_um.size() == 0;
    const Explained left = explained(data, is_free ? data.displacement_um : models[m].left_um);
    pulled.col(m) = numerics::transposed_matvec(C, left.target) / variance;
    chi_squared[m] = (left.target.squaredNorm() + left.floor_squared) / variance;
    models[m].bic_with_discrepancy = std::numeric_limits<double>::infinity();
  }
  const MatrixXd gram = numerics::gram(C, data.threads) / variance;
  const VectorXd free = free_forces_nN(data.reduced);
  const double largest_nN = 4 * std::sqrt(free.squaredNorm() / static_cast<double>(std::max<Index>(1, free.size())));
  constexpr int kSteps = 13;  // by factors of 2 down to a thousandth of the forces that the beads ask for, and 0
  for (int step = 0; step <= kSteps; ++step) {
    const double tau_nN = step < kSteps ? largest_nN * std::pow(2.0, -step) : 0;
    const VectorXd scores = minus_two_logs(gram, pulled, chi_squared, tau_nN * tau_nN, data.threads);
    for (Index m = 0; m < std::ssize(models); ++m) {
      const double price = models[m].left_um.size() == 0 ? 0 : models[m].bic - models[m].chi_squared;
      if (scores[m] + price >= models[m].bic_with_discrepancy) continue;
      models[m].bic_with_discrepancy = scores[m] + price;
      models[m].discrepancy_nN = tau_nN;
    }
  }
}

}  // namespace mbtfm::tensions
