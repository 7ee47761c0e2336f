#include "mbtfm/effects.h"

#include <Eigen/QR>
#include <cmath>

#include "mbtfm/robust.h"
#include "pipeline/contract/csv.h"

namespace mbtfm::inverse {

Tails tails_of(const LinearData& data, const std::string& robust_kind) {
  const Eigen::VectorXd forces = data.reduced.compliance.colPivHouseholderQr().solve(data.reduced.target);
  const Eigen::VectorXd residual = weighted_residual(data, forces);
  const double scale = robust_scale(data, residual);
  if (scale <= 0) return {};
  double squares = 0, psi_squares = 0, slope = 0, n = 0, n_far = 0;
  for (Eigen::Index i = 0; i < residual.size(); i += 2) {
    if (data.weight_per_um[i] <= 0) continue;
    const double r = residual.segment<2>(i).norm() / scale, weight = robust_weight(robust_kind, r);
    constexpr double kStep = 1e-4, kFar = 3.5;  // psi' by differences: psi is smooth but for one kink
    const double slope_of_psi = ((r + kStep) * robust_weight(robust_kind, r + kStep) - r * weight) / kStep;
    squares += r * r / 2;
    psi_squares += weight * weight * r * r / 2;
    slope += (slope_of_psi + weight) / 2;
    n_far += r > kFar ? 1 : 0;
    ++n;
  }
  // asymptotic variances in the plane: see misfit_variance
  return {.share = n_far / n, .excess = (squares / n) / (psi_squares * n / (slope * slope)) - 1};
}

Effect decide_robust_loss(const LinearData& data, const FitParameters& parameters, const std::string& setting) {
  constexpr const char* kName = "robust loss";
  // 5 %: see robust_weight. With fewer beads the excess of Gaussian noise comes as high by chance.
  constexpr double kGivenAway = 0.05;
  constexpr Eigen::Index kEnough = 1000;
  if (setting != "auto") return decided(kName, setting, true, "as asked");
  const Stopwatch watch;
  const Eigen::Index n_free = data.n_used - data.reduced.compliance.rows();
  if (n_free < kEnough) {
    return decided(kName, setting, false,
                   std::to_string(n_free / 2) +
                       " beads more than unknowns tell nothing of tails: " + std::to_string(kEnough / 2) + " would");
  }
  const Tails tails = tails_of(data, parameters.robust_kind);
  Effect effect = decided(kName, setting, tails.excess, kGivenAway,
                          "with " + brief(100 * tails.share) +
                              " % of the beads beyond 3.5 robust standard deviations, the variance of squares over "
                              "that of the loss, less 1, is");
  effect.seconds = watch.seconds();
  return effect;
}

Effect decide_time_coupling(bool has_frame_before, const std::string& setting) {
  Effect effect = decided("time coupling", setting, has_frame_before ? 1 : 0, 0, "number of frames before this one:");
  effect.is_on = effect.is_on && has_frame_before;
  return effect;
}

}  // namespace mbtfm::inverse
