#include "mbtfm/tensions/search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/tensions/ensemble.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/triangle.h"

namespace mbtfm::tensions {

MatrixXd by_root_of_area(MatrixXd compliance_um_per_nN, const std::vector<substrate::Ellipse>& places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double side_um = std::sqrt(std::numbers::pi) * places[i].semi_major_um;
    compliance_um_per_nN.middleCols<2>(2 * static_cast<Index>(i)) *= side_um;
  }
  return compliance_um_per_nN;
}

Scores at(const Scores& s, const std::vector<Index>& columns) {
  return {s.information(columns, columns), s.scores(columns)};
}

Scores beside(const Scores& s, const std::vector<Index>& columns, double kappa) {
  MatrixXd inner = s.information(columns, columns);
  inner.diagonal().array() += 1 / kappa;
  const MatrixXd across = s.information(Eigen::all, columns);
  const MatrixXd gain = numerics::solve_symmetric(inner, across.transpose()).transpose();
  return {.information = numerics::minus_product(s.information, gain, across.transpose()),
          .scores = numerics::minus_matvec(s.scores, gain, s.scores(columns))};
}

Spectrum spectrum_of(const Scores& s) {
  const auto [values, vectors] = numerics::symmetric_eigen(s.information);
  const double rounding = 1e-10 * std::max(values.maxCoeff(), 1e-300);
  const auto stands_out = (values.array() > rounding).cast<double>();
  return {.information = values.array() * stands_out,
          .found = numerics::transposed_matvec(vectors, s.scores).array().square() * stands_out};
}

double log_bayes_factor(const Spectrum& s, double kappa) {
  double sum = 0;
  for (Index i = 0; i < s.information.size(); ++i) {
    const double total = 1 + kappa * s.information[i];
    sum += kappa * s.found[i] / total - std::log(total);
  }
  return 0.5 * sum;
}

double likeliest_kappa(const Spectrum& s) {
  constexpr double kStep = 1.25, kLeast = 1e-6, kMost = 1e12;  // relative to what stands out of the noise just so
  const double unit = 1 / std::max(s.information.maxCoeff(), 1e-300);
  double best = 0, most = 0;
  for (double kappa = kLeast; kappa < kMost; kappa *= kStep) {
    const double here = log_bayes_factor(s, kappa * unit);
    if (here <= most) continue;
    most = here;
    best = kappa * unit;
  }
  return best;
}

std::vector<std::size_t> causes_among(Scores scores, const std::vector<std::vector<Index>>& columns,
                                      const std::vector<double>& log_odds_against, std::optional<double> kappa) {
  std::vector<std::size_t> causes;
  while (causes.size() < columns.size()) {
    std::size_t best = 0;
    double most = 0, its_kappa = 0;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (std::ranges::find(causes, k) != causes.end()) continue;
      const Spectrum spectrum = spectrum_of(at(scores, columns[k]));
      const double here_kappa = kappa ? *kappa : likeliest_kappa(spectrum),
                   here = log_bayes_factor(spectrum, here_kappa) - log_odds_against[k];
      if (here > most) best = k, most = here, its_kappa = here_kappa;
    }
    if (most <= 0) break;
    causes.push_back(best);
    scores = beside(scores, columns[best], its_kappa);
  }
  return causes;
}

Pattern pattern_of(const LinearData& data, const MatrixXd& columns_um) {
  const VectorXd weight = squared_weights(data);
  const MatrixXd weighted = weight.asDiagonal() * less_motion(data, columns_um);
  const MatrixXd pulled = data.response->pull_back(weighted);  // Gᵀ W² P X
  MatrixXd forces_nN = solve_normal(data.reduced, pulled);
  const MatrixXd left =
      numerics::transposed_product(columns_um, weighted) - numerics::transposed_product(pulled, forces_nN);
  const VectorXd residual = residual_um(data, free_forces_nN(data.reduced));
  return {.forces_nN = std::move(forces_nN),
          .beyond = {.information = 0.5 * (left + left.transpose()),
                     .scores = numerics::transposed_matvec(columns_um, weight.cwiseProduct(residual))}};
}

double variance_beside(const LinearData& data, const Scores& beyond) {
  const Spectrum s = spectrum_of(beyond);
  double explained = 0;
  auto n_left = static_cast<double>(data.n_used - data.reduced.n_felt);
  for (Index i = 0; i < s.information.size(); ++i) {
    if (s.information[i] <= 0) continue;
    explained += s.found[i] / s.information[i];
    n_left -= 1;
  }
  return std::max((data.reduced.floor_squared - explained) / std::max(1.0, n_left), data.has_errors ? 1.0 : 1e-300);
}

Left::Left(const EnsembleFit& fit)
    : Left(fit, fit.model_error ? fit.model_error->stated_variance_nN2 : VectorXd(), fit.misfit.variance,
           fit.data.threads) {}

Left::Left(const EnsembleFit& fit, const VectorXd& force_variance_nN2, double variance, int threads)
    : data_(force_variance_nN2.size() > 0 ? whitened(fit.data.reduced, force_variance_nN2 / variance, threads)
                                          : fit.data.reduced),
      variance_(variance),
      threads_(threads) {
  const VectorXd residual = data_.target - displace(data_, fit.forces.nN);
  const MatrixXd CJ = displace(data_, fit.meshes.front().force_derivatives, threads);
  const MatrixXd cross_terms = numerics::transposed_product(CJ, *data_.compliance, threads);
  MatrixXd H = numerics::small_transposed_product(CJ, CJ);
  H.diagonal() += 1e-9 * H.diagonal() + VectorXd::Constant(H.rows(), 1e-300);
  const numerics::SmallCholesky solver(H);
  followed_ = solver.solve_lower(cross_terms);
  scores_ = numerics::transposed_matvec(*data_.compliance, residual) -
            numerics::transposed_matvec(cross_terms, solver.solve(numerics::transposed_matvec(CJ, residual)));
}

Scores Left::over_s(const MatrixXd& compliance, const MatrixXd& followed, const VectorXd& scores) const {
  return {.information = numerics::small_transposed_product(compliance, compliance) -
                         numerics::small_transposed_product(followed, followed),
          .scores = scores / std::sqrt(variance_)};
}

Scores Left::scores_of(const Pattern& pattern) const {
  const MatrixXd& X = pattern.forces_nN;
  Scores scores = over_s(displace(data_, X, threads_), numerics::product(followed_, X, threads_),
                         numerics::transposed_matvec(X, scores_) + pattern.beyond.scores);
  scores.information += pattern.beyond.information;
  return scores;
}

Scores Left::scores_of(const std::vector<Index>& components) const {
  return over_s((*data_.compliance)(Eigen::all, components), followed_(Eigen::all, components), scores_(components));
}

void Left::for_each_block(const std::function<void(Index, const MatrixXd&)>& body) const {
  numerics::for_each_gram_block(*data_.compliance, threads_, [&](Index first, const MatrixXd& gram) {
    body(first, gram - numerics::transposed_product(followed_.leftCols(gram.rows()),
                                                    followed_.middleCols(first, gram.cols()), threads_));
  });
}

}  // namespace mbtfm::tensions
