#include "mbtfm/spatial/loss.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "mbtfm/spatial/observed.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::spatial {
namespace {

using Eigen::Index;

// by number of components, 1 to 3
constexpr std::array kHuber = {1.345, 1.501, 1.628}, kBiweight = {4.685, 5.123, 5.490};
constexpr std::array kMedianLength = {0.6745, 1.1774, 1.5382};  ///< of Gaussian vectors (chi distribution)
constexpr double kSmallest = 0.1;  ///< of a residual, where l1 has an edge: a tenth of a standard deviation

/// Slope of psi.
double slope(BeadLoss loss, double r, Index n) {
  constexpr double kStep = 1e-4;  // psi is smooth but at a point
  const auto psi = [&](double x) { return x * loss_weight(loss, x, n); };
  return (psi(r + kStep) - psi(std::max(0.0, r - kStep))) / (r + kStep - std::max(0.0, r - kStep));
}

}  // namespace

double loss_weight(BeadLoss loss, double r, Index n) {
  const auto at = static_cast<std::size_t>(n - 1);
  switch (loss) {
    case BeadLoss::l2:
      return 1;
    case BeadLoss::mixture:
      break;  // not by the residual
    case BeadLoss::l1:
    case BeadLoss::l1_by_component:
      return kSmallest / std::max(r, kSmallest);
    case BeadLoss::huber:
      return std::min(1.0, kHuber.at(at) / std::max(r, 1e-300));
    case BeadLoss::biweight: {
      const double share = r / kBiweight.at(at);
      return share < 1 ? (1 - share * share) * (1 - share * share) : 0;
    }
  }
  throw InternalError("unknown loss");
}

double median_length(Index n_components) { return kMedianLength.at(static_cast<std::size_t>(n_components - 1)); }

Weighing weigh(BeadLoss loss, const Observed& observed, const Eigen::VectorXd& residual, double degrees,
               const std::vector<double>& good) {
  const bool is_by_component = loss == BeadLoss::l1_by_component;
  const Index n = is_by_component ? 1 : observed.n_components(), n_groups = residual.size() / n;
  std::vector<double> lengths;
  for (Index b = 0; b < n_groups; ++b) lengths.push_back(residual.segment(n * b, n).norm());
  const auto n_rows = static_cast<double>(residual.size());
  const double taken = std::sqrt(std::max(1 - degrees / n_rows, 0.1));  // followed noise leaves less
  Weighing weighing;
  weighing.by_row = Eigen::VectorXd::Ones(residual.size());
  if (!weighs_by_residual(loss)) {
    for (std::size_t k = 0; k < good.size(); ++k)
      weighing.by_row.segment(n * static_cast<Index>(k), n).setConstant(good[k]);
    weighing.n_data = std::max(weighing.by_row.sum(), 1e-300);
    weighing.scale = weighing.by_row.cwiseSqrt().cwiseProduct(residual).norm() / std::sqrt(weighing.n_data) / taken;
    weighing.variance = weighing.scale * weighing.scale;
    return weighing;
  }
  weighing.scale = numerics::median(lengths) / median_length(n) / taken;
  const double scale = std::max(observed.states_errors ? 1.0 : 0.0, weighing.scale);
  double score = 0, curvature = 0, square = 0, mean = 0;  // means over the groups
  for (Index b = 0; b < n_groups; ++b) {
    const double r = lengths[b] / std::max(scale, 1e-300);
    const double w = loss_weight(loss, r, n);
    weighing.by_row.segment(n * b, n).setConstant(w);
    score += w * w * r * r / n_rows;
    square += w * r * r / n_rows;
    curvature += (slope(loss, r, n) + static_cast<double>(n - 1) * w) / n_rows;
    mean += w / static_cast<double>(n_groups);
  }
  // An M-estimator varies as least squares with weights `mean` and the variance of its scores over their slope squared
  // (Maronna, Martin & Yohai, 10.3).
  weighing.variance = scale * scale * mean * score / (curvature * curvature);
  weighing.n_data = n_rows * scale * scale * square / weighing.variance;
  return weighing;
}

}  // namespace mbtfm::spatial
