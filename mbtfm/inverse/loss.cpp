#include "mbtfm/inverse/loss.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::inverse {

namespace {

// by number of components, 1 to 3
constexpr std::array kHuber = {1.345, 1.501, 1.628}, kTukey = {4.685, 5.123, 5.490};
constexpr std::array kMedianLength = {1 / 1.4826, 1.1774100225154747, 1.5381722544550522};
// An l1 weight grows without bound at zero; below a hundredth of the noise a residual is as good as none.
constexpr double kSmallest = 0.01;

double constant(const std::array<double, 3>& constants, Index n) {
  return constants.at(static_cast<std::size_t>(n - 1));
}

/// psi'
double slope(Loss loss, double r, Index n) {
  switch (loss) {
    case Loss::squares:
      return 1;
    case Loss::huber:
      return r < constant(kHuber, n) ? 1 : 0;
    case Loss::tukey: {
      const double square = std::pow(r / constant(kTukey, n), 2);
      return square < 1 ? (1 - square) * (1 - 5 * square) : 0;
    }
    case Loss::l1:
      return r < kSmallest ? 1 / kSmallest : 0;
  }
  throw InternalError("unknown loss");
}

}  // namespace

double weight(Loss loss, double r, Index n) {
  switch (loss) {
    case Loss::squares:
      return 1;
    case Loss::huber:
      return std::min(1.0, constant(kHuber, n) / std::max(r, 1e-300));
    case Loss::tukey: {
      const double square = std::pow(r / constant(kTukey, n), 2);
      return square < 1 ? (1 - square) * (1 - square) : 0;
    }
    case Loss::l1:
      return 1 / std::max(r, kSmallest);
  }
  throw InternalError("unknown loss");
}

VectorXd weights_of(Loss loss, const numerics::VectorView& residual, double scale, Index n) {
  VectorXd weights(residual.size() / n);
  for (Index k = 0; k < weights.size(); ++k) weights[k] = weight(loss, residual.segment(n * k, n).norm() / scale, n);
  return weights;
}

double median_length(Index n) { return constant(kMedianLength, n); }

std::vector<double> residual_lengths(const numerics::VectorView& residual, Index n) {
  std::vector<double> lengths;
  for (Index row = 0; row < residual.size(); row += n) lengths.push_back(residual.segment(row, n).norm());
  return lengths;
}

double scale_of(std::vector<double> lengths, Index n) {
  return lengths.empty() ? 0 : numerics::median_in(lengths) / median_length(n);
}

std::vector<Loss> in_turn(Loss loss) {
  return loss == Loss::tukey ? std::vector{Loss::huber, Loss::tukey} : std::vector{loss};
}

Estimator estimator_of(Loss loss, const std::vector<double>& lengths, double scale, Index n) {
  double psi_squared = 0, curvature = 0, square = 0, sum = 0;
  for (const double length : lengths) {
    const double r = length / scale, w = weight(loss, r, n);
    psi_squared += w * w * r * r;
    square += w * r * r;
    curvature += slope(loss, r, n) + static_cast<double>(n - 1) * w;
    sum += w;
  }
  const auto n_components = static_cast<double>(n);
  return {.variance = scale * scale * n_components * psi_squared * sum / (curvature * curvature),
          .square = square / (n_components * static_cast<double>(lengths.size()))};
}

}  // namespace mbtfm::inverse
