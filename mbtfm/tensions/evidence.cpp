#include "mbtfm/tensions/evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "pipeline/contract/errors.h"
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

namespace {

constexpr double kLeast_nN = 1e-9;  ///< far below any tension: for a fit without noise, or without other fibres

/// Sum of the squares of tensions.
struct Squares {
  double nN2 = 0;
  int n = 0;
  void add(double tension_nN) {
    nN2 += tension_nN * tension_nN;
    ++n;
  }
  double mean() const { return nN2 / std::max(1, n); }
};

}  // namespace

double log_odds(double confidence, double tension_nN, double sigma_nN, double usual_nN) {
  const double w = std::hypot(sigma_nN, usual_nN), x = tension_nN * usual_nN / (sigma_nN * w);
  const double phi = 0.5 * std::erfc(-x / std::numbers::sqrt2);
  return std::log(confidence / (1 - confidence)) + std::log(2 * sigma_nN / w) + x * x / 2 + std::log(phi);
}

std::vector<double> existence_of(const EnsembleFit& fit, const std::vector<Fibre>& fibres) {
  std::vector<const Fibre*> fitted;
  for (std::size_t i = 1; i < fit.tensions.fibre_ids.size(); ++i) {
    const auto fibre = std::ranges::find(fibres, fit.tensions.fibre_ids[i], &Fibre::fibre_id);
    MBTFM_ASSERT(fibre != fibres.end());
    fitted.push_back(&*fibre);
  }
  std::vector<double> existence;
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    Squares of_type, of_all;
    for (std::size_t j = 0; j < fitted.size(); ++j) {
      if (j == i) continue;
      const double tension_nN = fit.tensions.nN[j + 1].value;
      of_all.add(tension_nN);
      if (fitted[j]->type == fitted[i]->type) of_type.add(tension_nN);
    }
    of_type.add(std::sqrt(of_all.mean()));
    const Estimate& tension = fit.tensions.nN[i + 1];
    const double odds = log_odds(fitted[i]->confidence, tension.value, std::max(kLeast_nN, tension.standard_error),
                                 std::max(kLeast_nN, std::sqrt(of_type.mean())));
    existence.push_back(1 / (1 + std::exp(-odds)));
  }
  return existence;
}

}  // namespace mbtfm::tensions
