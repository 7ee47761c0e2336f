#include "mbtfm/inverse/spectrum.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "pipeline/numerics/dense.h"

namespace mbtfm::inverse {

using Eigen::ArrayXd;

namespace {

constexpr double kRounding = 1e-12;  // of the largest value of AᵀA: what is below is rounding

Eigen::Array<bool, Eigen::Dynamic, 1> is_felt(const ArrayXd& values) { return values > 0; }

}  // namespace

Spectrum spectrum_of(const MatrixXd& A, const VectorXd& u, double n_data, int threads) {
  return {numerics::gram(A, threads), numerics::transposed_matvec(A, u), u.squaredNorm(), n_data};
}

Spectrum::Spectrum(MatrixXd normal, const VectorXd& adjoint, double data_squared, double n_data)
    : data_squared_(data_squared), n_data_(n_data) {
  auto [values, vectors] = numerics::symmetric_eigen(std::move(normal));
  vectors_ = std::make_shared<const MatrixXd>(std::move(vectors));
  projected_ = numerics::transposed_matvec(*vectors_, adjoint);
  // Of fewer data than unknowns the other directions have values of rounding. The risk has them over lambda².
  const Eigen::Array<bool, Eigen::Dynamic, 1> felt = values.array() > kRounding * values.maxCoeff();
  values_ = felt.select(values.array(), 0);
  projected_ = felt.select(projected_, 0);
}

Spectrum Spectrum::with_noise(double variance) const {
  Spectrum noisy = *this;
  noisy.projected_ = (projected_.square() + variance * values_).sqrt();
  noisy.data_squared_ += variance * n_data_;
  return noisy;
}

LambdaScan Spectrum::scan(std::optional<double> stated_variance, SignalIn signal_in) const {
  return scan(
      std::sqrt(kRounding), [this](double lambda) { return degrees(lambda); },
      static_cast<double>(is_felt(values_).count()), stated_variance, signal_in);
}

LambdaScan Spectrum::scan(double smallest_part, const std::function<double(double)>& degrees_at, double n_felt,
                          std::optional<double> stated_variance, SignalIn signal_in) const {
  const double largest = std::sqrt(values_.maxCoeff());
  // At a tenth of the smallest singular value nothing is smoothed any more; where there are others it ends with them.
  const double smallest = std::max(0.1 * std::sqrt(values_.minCoeff()), smallest_part * largest);
  std::vector<ScanPoint> points;
  for (const double lambda : lambdas_between(largest, smallest))
    points.push_back({.lambda = lambda,
                      .misfit = misfit(lambda),
                      .norm = (projected_ / (values_ + lambda * lambda)).square().sum(),
                      .degrees = degrees_at(lambda)});
  const Risks risks = [&](const std::vector<ScanPoint>& scanned, double variance) {
    if (signal_in == SignalIn::resolved) return risks_of_resolved(scanned, variance);
    std::vector<double> by_point;
    for (const ScanPoint& p : scanned)
      by_point.push_back(unbiased_risk(p, removable_misfit(p.lambda), n_felt, variance));
    return by_point;
  };
  // Few loads follow many beads nowhere quite: what they leave, noise or not, is the error of each bead. (Its median,
  // for tractions that follow all but a few, would call most of it signal.)
  return judge(
      std::move(points), n_data_, stated_variance,
      [&](double lambda) { return misfit(lambda) / (n_data_ - degrees_at(lambda)); }, risks);
}

Eigen::Array<bool, Eigen::Dynamic, 1> Spectrum::is_resolved(double variance) const {
  constexpr Index kLeast = 30;   // squares of noise whose sum is nearly Gaussian
  constexpr double kChance = 3;  // standard deviations of that sum
  const Eigen::Array<bool, Eigen::Dynamic, 1> felt = is_felt(values_);
  std::vector<Index> order;  // felt most first
  for (Index k = 0; k < values_.size(); ++k)
    if (felt[k]) order.push_back(k);
  std::ranges::sort(order, std::greater{}, [&](Index k) { return values_[k]; });
  const auto n = std::ssize(order);
  std::vector<double> up_to = {0};  // sums of squares, each with this variance if it is noise
  for (const Index k : order) up_to.push_back(up_to.back() + projected_[k] * projected_[k] / values_[k]);
  Eigen::Array<bool, Eigen::Dynamic, 1> resolved(values_.size());
  resolved.setConstant(false);
  for (Index k = 0; k < n; ++k) {
    const Index next = std::min(std::max(k, kLeast), n - k);
    const double squares = up_to[k + next] - up_to[k];
    const auto m = static_cast<double>(next);
    if (squares <= variance * (m + kChance * std::sqrt(2 * m))) break;
    resolved[order[k]] = true;
  }
  return resolved;
}

std::vector<double> Spectrum::risks_of_resolved(const std::vector<ScanPoint>& points, double variance) const {
  const Eigen::Array<bool, Eigen::Dynamic, 1> resolved = is_resolved(variance), felt = is_felt(values_);
  const ArrayXd signal =
      resolved.select(projected_.square() / values_ - variance, 0);  // expected s sqrt(value), squared
  const ArrayXd squares =
      resolved.select(projected_.square(), felt.select(variance * values_, ArrayXd::Zero(values_.size())));
  std::vector<double> by_point;
  for (const ScanPoint& p : points) {
    const ArrayXd stiffness = values_ + p.lambda * p.lambda;
    by_point.push_back((squares / stiffness.square() - 2 * signal / stiffness).sum());
  }
  return by_point;
}

std::optional<double> Spectrum::variance_felt_least() const {
  constexpr double kChance = 3;  // standard deviations of the ratio of two variances of Gaussian noise
  std::vector<std::pair<double, double>> coefficients;  // by value
  double followed = 0;
  const Eigen::Array<bool, Eigen::Dynamic, 1> felt = is_felt(values_);
  for (Index k = 0; k < values_.size(); ++k) {
    if (!felt[k]) continue;
    const double square = projected_[k] * projected_[k] / values_[k];
    coefficients.emplace_back(values_[k], square);
    followed += square;
  }
  const auto n_half = static_cast<double>(coefficients.size() / 2);
  const double n_beside = n_data_ - static_cast<double>(coefficients.size());
  if (n_half < 1 || n_beside < 1) return std::nullopt;
  const double beside = std::max(0.0, data_squared_ - followed) / n_beside;
  std::sort(coefficients.begin(), coefficients.end());
  double least = 0;
  for (std::size_t k = 0; k < coefficients.size() / 2; ++k) least += coefficients[k].second / n_half;
  if (least <= beside * (1 + kChance * std::sqrt(2 / n_half + 2 / n_beside))) return std::nullopt;
  return least;
}

double Spectrum::removable_misfit(double lambda) const {
  const ArrayXd shares = projected_ / (values_ + lambda * lambda);
  return is_felt(values_).select(shares.square() / values_, 0).sum() * std::pow(lambda, 4);
}

double Spectrum::explained(double lambda) const { return (projected_.square() / (values_ + lambda * lambda)).sum(); }

VectorXd Spectrum::solve(double lambda) const {
  return numerics::matvec(*vectors_, (projected_ / (values_ + lambda * lambda)).matrix());
}

VectorXd Spectrum::solve(double lambda, const VectorXd& added) const {
  const VectorXd right = projected_.matrix() + numerics::transposed_matvec(*vectors_, added);
  return numerics::matvec(*vectors_, (right.array() / (values_ + lambda * lambda)).matrix());
}

MatrixXd Spectrum::outer(const ArrayXd& shares) const {
  MatrixXd sum = MatrixXd::Zero(vectors_->rows(), vectors_->rows());
  numerics::add_upper_outer(*vectors_ * shares.sqrt().matrix().asDiagonal(), sum);
  numerics::mirror_upper(sum);
  return sum;
}

MatrixXd Spectrum::covariance(double lambda, double variance) const {
  return outer(variance * values_ / (values_ + lambda * lambda).square());
}

MatrixXd Spectrum::posterior(double lambda, double variance) const {
  return outer(variance / (values_ + lambda * lambda));
}

VectorXd Spectrum::error_variances(double lambda, double variance, double prior_variance) const {
  const ArrayXd stiffness = (values_ + lambda * lambda).square();
  return vectors_->array().square().matrix() *
         ((variance * values_ + prior_variance * std::pow(lambda, 4)) / stiffness).matrix();
}

double Spectrum::misfit_in_frame(const ArrayXd& shares) const {
  return data_squared_ - 2 * (shares * projected_).sum() + (values_ * shares.square()).sum();
}
double Spectrum::misfit(double lambda) const { return misfit_in_frame(projected_ / (values_ + lambda * lambda)); }
double Spectrum::misfit_of(const VectorXd& s) const {
  return misfit_in_frame(numerics::transposed_matvec(*vectors_, s).array());
}

double Spectrum::degrees(double lambda) const { return (values_ / (values_ + lambda * lambda)).sum(); }

double Spectrum::relative_l2(double lambda) const {
  return data_squared_ > 0 ? std::sqrt(std::max(0.0, misfit(lambda)) / data_squared_) : 0;
}

namespace {

/// A V = U B, Aᵀ U = V Bᵀ with B lower bidiagonal.
struct Recurrence {
  MatrixXd left, right;  ///< U, V
  std::vector<double> alpha, beta;
  double start = 0;  ///< length of the vector it starts from
  bool is_done = false;

  /// Makes v column n of the basis: orthogonal to those before, of length one. @returns its length before; 0 where it
  /// is what rounding left: then the recurrence is done. Twice is enough (Parlett, The Symmetric Eigenvalue
  /// Problem, 6.9).
  double append(VectorXd v, MatrixXd& basis, Index n) {
    constexpr double kNothing = 1e-13;  // of the first
    for (int pass = 0; pass < 2; ++pass) v -= basis.leftCols(n) * (basis.leftCols(n).transpose() * v);
    const double length = v.norm();
    is_done = !(length > kNothing * (alpha.empty() ? 0 : alpha.front()));
    if (is_done) return 0;
    basis.col(n) = v / length;
    return length;
  }
  /// The problem in this basis, whose data is start e_1.
  Spectrum small(double n_data) const {
    const auto k = static_cast<Index>(alpha.size());
    MatrixXd bidiagonal = MatrixXd::Zero(k + 1, k);
    for (Index j = 0; j < k; ++j) {
      bidiagonal(j, j) = alpha[j];
      if (j < std::ssize(beta)) bidiagonal(j + 1, j) = beta[j];
    }
    return {bidiagonal.transpose() * bidiagonal, start * bidiagonal.row(0).transpose(), start * start, n_data};
  }
};

}  // namespace

Recurrences::Recurrences(const LinearMap& map, const VectorXd& data, const RecurrenceOptions& options)
    : n_felt_(static_cast<double>(std::min(map.n_data, map.n_unknowns))) {
  const auto steps = std::min<Index>(options.steps, std::min(map.n_data, map.n_unknowns));
  const Index n = 1 + options.probes;
  std::mt19937_64 random(options.seed);
  std::vector<Recurrence> all(static_cast<std::size_t>(n));
  for (Recurrence& r : all) {
    VectorXd first = data;
    if (&r != &all.front())
      for (double& sign : first) sign = random() >> 63 ? 1 : -1;
    r.start = first.norm();
    r.left = MatrixXd::Zero(map.n_data, steps + 1);
    r.right = MatrixXd::Zero(map.n_unknowns, steps);
    r.is_done = r.start == 0;
    if (!r.is_done) r.left.col(0) = first / r.start;
  }
  const auto side_by_side = [&](MatrixXd Recurrence::*basis, Index j) {
    MatrixXd columns((all.front().*basis).rows(), n);
    for (Index k = 0; k < n; ++k) columns.col(k) = (all[k].*basis).col(j);
    return columns;
  };
  for (Index j = 0; j < steps; ++j) {
    const MatrixXd adjoint = map.transposed(side_by_side(&Recurrence::left, j));
    for (Index k = 0; k < n; ++k) {
      Recurrence& r = all[k];
      const double alpha = r.is_done ? 0 : r.append(adjoint.col(k), r.right, j);
      if (alpha > 0) r.alpha.push_back(alpha);
    }
    const MatrixXd moved = map.forward(side_by_side(&Recurrence::right, j));
    for (Index k = 0; k < n; ++k) {
      Recurrence& r = all[k];
      if (!r.is_done) r.beta.push_back(r.append(moved.col(k), r.left, j + 1));
    }
  }
  basis_ = all.front().right.leftCols(std::ssize(all.front().alpha));
  for (const Recurrence& r : all) small_.push_back(r.small(static_cast<double>(map.n_data)));
}

double Recurrences::degrees(double lambda) const {
  double sum = 0;
  for (std::size_t k = 1; k < small_.size(); ++k) sum += small_[k].explained(lambda);
  return std::min(sum / static_cast<double>(small_.size() - 1), n_felt_);
}

LambdaScan Recurrences::scan(std::optional<double> stated_variance) const {
  // the least values of the small problem have not settled: below a thousandth of the largest, lambda would hang on
  // them
  return small_.front().scan(
      1e-3, [this](double lambda) { return degrees(lambda); }, n_felt_, stated_variance, SignalIn::felt);
}

}  // namespace mbtfm::inverse
