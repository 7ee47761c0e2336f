#include "mbtfm/tensions/random_forces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/dense.h"

namespace mbtfm::tensions {

MatrixXd by_root_of_area(MatrixXd compliance_um_per_nN, const std::vector<substrate::Ellipse>& places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double side_um = std::sqrt(std::numbers::pi) * places[i].semi_major_um;
    compliance_um_per_nN.middleCols<2>(2 * static_cast<Index>(i)) *= side_um;
  }
  return compliance_um_per_nN;
}

RandomScores random_scores(const LinearData& data, const MatrixXd& Z) {
  const VectorXd weight = squared_weights(data);
  const MatrixXd weighted = weight.asDiagonal() * less_motion(data, Z);
  const MatrixXd pulled = data.response->pull_back(weighted);  // Gᵀ W² P Z
  const MatrixXd left = numerics::transposed_product(Z, weighted) -
                        numerics::transposed_product(pulled, solve_normal(data.reduced, pulled));
  const VectorXd residual = residual_um(data, free_forces_nN(data.reduced));
  return {.information = 0.5 * (left + left.transpose()),
          .scores = numerics::transposed_matvec(Z, weight.cwiseProduct(residual))};
}

RandomScores beside(const RandomScores& s, const std::vector<Index>& columns, double kappa) {
  MatrixXd inner = s.information(columns, columns);
  inner.diagonal().array() += 1 / kappa;
  const MatrixXd across = s.information(Eigen::all, columns);
  const MatrixXd gain = numerics::solve_symmetric(inner, across.transpose()).transpose();
  return {.information = numerics::minus_product(s.information, gain, across.transpose()),
          .scores = numerics::minus_matvec(s.scores, gain, s.scores(columns))};
}

Spectrum spectrum_of(const RandomScores& s) {
  const auto [values, vectors] = numerics::symmetric_eigen(s.information);
  const double rounding = 1e-10 * std::max(values.maxCoeff(), 1e-300);
  const auto stands_out = (values.array() > rounding).cast<double>();
  return {.information = values.array() * stands_out,
          .found = numerics::transposed_matvec(vectors, s.scores).array().square() * stands_out};
}

double variance_beside(const LinearData& data, const Spectrum& s) {
  double explained = 0;
  auto n_left = static_cast<double>(data.n_used - data.reduced.n_felt);
  for (Index i = 0; i < s.information.size(); ++i) {
    if (s.information[i] <= 0) continue;
    explained += s.found[i] / s.information[i];
    n_left -= 1;
  }
  return std::max((data.reduced.floor_squared - explained) / std::max(1.0, n_left), data.has_errors ? 1.0 : 1e-300);
}

double surprise(const Spectrum& s, double kappa) {
  double sum = 0;
  for (Index i = 0; i < s.information.size(); ++i) {
    const double total = 1 + kappa * s.information[i];
    sum += std::log(total) - kappa * s.found[i] / total;
  }
  return sum;
}

double likeliest_kappa(const Spectrum& s) {
  constexpr double kStep = 1.25, kLeast = 1e-6, kMost = 1e12;  // relative to what stands out of the noise just so
  const double unit = 1 / std::max(s.information.maxCoeff(), 1e-300);
  double best = 0, least = 0;
  for (double kappa = kLeast; kappa < kMost; kappa *= kStep) {
    const double here = surprise(s, kappa * unit);
    if (here >= least) continue;
    least = here;
    best = kappa * unit;
  }
  return best;
}

}  // namespace mbtfm::tensions
