#include "segment/stacks/mean_by_depth.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace mbtfm::stacks {
namespace {

using Eigen::Index;
using Eigen::MatrixX2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

MatrixXd of_gel(const MeanByDepth& mean, double length_um) {
  const auto n = static_cast<Index>(mean.z_um.size());
  MatrixXd covariance(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const double apart = (mean.z_um[i] - mean.z_um[j]) / length_um;
      covariance(i, j) = mean.field_um[i] * mean.field_um[j] * std::exp(-0.5 * apart * apart);
    }
    covariance(i, i) += mean.field_um[i] * mean.field_um[i] / std::max(1.0, mean.beads_by_place[i]);
  }
  return covariance;
}

/// A walk begins anywhere: the shift is free.
MatrixXd of_stage(Index n, double steps, double jitter) {
  MatrixXd covariance(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) covariance(i, j) = steps * static_cast<double>(std::min(i, j));
  }
  covariance.diagonal().array() += jitter;
  return covariance;
}

struct Model {
  MatrixXd stage;
  Eigen::LLT<MatrixXd> whole;
  VectorXd of_shift;     ///< C⁻¹ 1
  double precision = 0;  ///< 1ᵀ C⁻¹ 1
  Vector2d shift_um;
  MatrixX2d weighed;          ///< C⁻¹ (mean − shift)
  double log_likelihood = 0;  ///< restricted, of both components
};

Model model_of(const MeanByDepth& mean, const MatrixXd& still, MatrixXd stage) {
  const Index n = still.rows();
  Model m;
  m.stage = std::move(stage);
  m.whole.compute(still + m.stage);
  m.of_shift = m.whole.solve(VectorXd::Ones(n));
  m.precision = m.of_shift.sum();
  m.shift_um = (m.of_shift.transpose() * mean.um).transpose() / m.precision;
  const MatrixX2d left = mean.um.rowwise() - m.shift_um.transpose();
  m.weighed = m.whole.solve(left);
  const double log_determinant = 2 * m.whole.matrixLLT().diagonal().array().log().sum();
  m.log_likelihood = -log_determinant - std::log(m.precision) - 0.5 * left.cwiseProduct(m.weighed).sum();
  return m;
}

}  // namespace

StageByDepth stage_by_depth(const MeanByDepth& mean, bool may_drift) {
  const auto n = static_cast<Index>(mean.z_um.size());
  const double range_um = std::max(1e-9, mean.z_um.back() - mean.z_um.front());
  // a floor for the factorisation, far below any bead's error
  const MatrixXd noise = mean.noise_um2 + 1e-12 * MatrixXd::Identity(n, n);
  std::optional<Model> still, moving;
  const auto better = [](std::optional<Model>& old, Model&& other) {
    if (!old || other.log_likelihood > old->log_likelihood) old = std::move(other);
  };
  for (const double parts : {2, 4, 8, 16}) {
    const MatrixXd without = of_gel(mean, range_um / parts) + noise;
    better(still, model_of(mean, without, MatrixXd::Zero(n, n)));
    if (!may_drift) continue;
    // standard deviations from a nanometre on, by factors of three
    constexpr double kLeast_um = 1e-3;
    constexpr int kFactors = 7;
    for (int steps = -1; steps < kFactors; ++steps) {
      for (int jitter = steps < 0 ? 0 : -1; jitter < kFactors; ++jitter) {
        const auto variance = [&](int k) { return k < 0 ? 0.0 : std::pow(kLeast_um * std::pow(3, k), 2); };
        better(moving, model_of(mean, without, of_stage(n, variance(steps), variance(jitter))));
      }
    }
  }
  const Model& model = moving ? *moving : *still;
  StageByDepth result;
  // the least steps that are tried may fit worse than none
  result.log_likelihood_gain = std::max(0.0, model.log_likelihood - still->log_likelihood);
  result.um = (model.stage * model.weighed).rowwise() + model.shift_um.transpose();
  // cov(stage + shift − theirs) = D − D C⁻¹ D + (1 − D C⁻¹ 1)(1 − D C⁻¹ 1)ᵀ / 1ᵀ C⁻¹ 1
  const VectorXd remote = VectorXd::Ones(n) - model.stage * model.of_shift;
  const MatrixXd covariance =
      model.stage - model.stage * model.whole.solve(model.stage) + remote * remote.transpose() / model.precision;
  result.sigma_um = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  result.shift_um = result.um.colwise().mean().transpose();
  result.shift_sigma_um = std::sqrt(std::max(0.0, covariance.mean()));
  result.drift_um = result.um.rowwise() - result.shift_um.transpose();
  const VectorXd with_shift = covariance.rowwise().mean();
  result.drift_sigma_um = ((covariance.diagonal() - 2 * with_shift).array() + covariance.mean()).cwiseMax(0).sqrt();
  return result;
}

}  // namespace mbtfm::stacks
