#include "mbtfm/tractions/spectrum.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "pipeline/numerics/dense.h"

namespace mbtfm::tractions {

using Eigen::ArrayXd;

namespace {

constexpr double kRounding = 1e-12;  // of the largest value of AᵀA: what is below is rounding

Eigen::Array<bool, Eigen::Dynamic, 1> is_felt(const ArrayXd& values) { return values > 0; }

}  // namespace

Spectrum::Spectrum(MatrixXd normal, VectorXd pulled, double data_squared, double n_data)
    : data_squared_(data_squared), n_data_(n_data) {
  auto [values, vectors] = numerics::symmetric_eigen(std::move(normal));
  vectors_ = std::make_shared<const MatrixXd>(std::move(vectors));
  projected_ = numerics::transposed_matvec(*vectors_, pulled);
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
  const double largest = std::sqrt(values_.maxCoeff());
  // At a tenth of the smallest singular value nothing is smoothed any more; where there are others it ends with them.
  const double smallest = std::max(0.1 * std::sqrt(values_.minCoeff()), std::sqrt(kRounding) * largest);
  std::vector<ScanPoint> points;
  for (const double lambda : lambdas_between(largest, smallest)) points.push_back(point_at(lambda));
  // Few loads follow many beads nowhere quite: what they leave, noise or not, is the error of each bead. (Its median,
  // for tractions that follow all but a few, would call most of it signal.)
  const auto n_felt = static_cast<double>(is_felt(values_).count());
  const Risks risks = [&](const std::vector<ScanPoint>& scanned, double variance) {
    if (signal_in == SignalIn::told) return told_risks(scanned, variance);
    std::vector<double> of_points;
    for (const ScanPoint& p : scanned)
      of_points.push_back(unbiased_risk(p, removable_misfit(p.lambda), n_felt, variance));
    return of_points;
  };
  return judge(
      std::move(points), n_data_, stated_variance,
      [&](double lambda) { return misfit(lambda) / (n_data_ - degrees(lambda)); }, risks);
}

Eigen::Array<bool, Eigen::Dynamic, 1> Spectrum::is_told(double variance) const {
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
  Eigen::Array<bool, Eigen::Dynamic, 1> told(values_.size());
  told.setConstant(false);
  for (Index k = 0; k < n; ++k) {
    const Index next = std::min(std::max(k, kLeast), n - k);
    const double squares = up_to[k + next] - up_to[k];
    const auto m = static_cast<double>(next);
    if (squares <= variance * (m + kChance * std::sqrt(2 * m))) break;
    told[order[k]] = true;
  }
  return told;
}

std::vector<double> Spectrum::told_risks(const std::vector<ScanPoint>& points, double variance) const {
  const Eigen::Array<bool, Eigen::Dynamic, 1> told = is_told(variance), felt = is_felt(values_);
  const ArrayXd signal = told.select(projected_.square() / values_ - variance, 0);  // expected s sqrt(value), squared
  const ArrayXd squares =
      told.select(projected_.square(), felt.select(variance * values_, ArrayXd::Zero(values_.size())));
  std::vector<double> of_points;
  for (const ScanPoint& p : points) {
    const ArrayXd stiffness = values_ + p.lambda * p.lambda;
    of_points.push_back((squares / stiffness.square() - 2 * signal / stiffness).sum());
  }
  return of_points;
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

ScanPoint Spectrum::point_at(double lambda) const {
  const ArrayXd shares = projected_ / (values_ + lambda * lambda);
  return {.lambda = lambda, .misfit = misfit(lambda), .norm = shares.square().sum(), .degrees = degrees(lambda)};
}

double Spectrum::removable_misfit(double lambda) const {
  const ArrayXd shares = projected_ / (values_ + lambda * lambda);
  return is_felt(values_).select(shares.square() / values_, 0).sum() * std::pow(lambda, 4);
}

double Spectrum::explained(double lambda) const { return (projected_.square() / (values_ + lambda * lambda)).sum(); }

VectorXd Spectrum::solve(double lambda) const {
  return numerics::matvec(*vectors_, (projected_ / (values_ + lambda * lambda)).matrix());
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

VectorXd Spectrum::resolved(double lambda) const {
  return vectors_->array().square().matrix() * (values_ / (values_ + lambda * lambda)).matrix();
}

double Spectrum::misfit(double lambda) const {
  const ArrayXd shares = projected_ / (values_ + lambda * lambda);
  return data_squared_ - 2 * (shares * projected_).sum() + (values_ * shares.square()).sum();
}

double Spectrum::degrees(double lambda) const { return (values_ / (values_ + lambda * lambda)).sum(); }

double Spectrum::relative_l2(double lambda) const {
  return data_squared_ > 0 ? std::sqrt(std::max(0.0, misfit(lambda)) / data_squared_) : 0;
}

}  // namespace mbtfm::tractions
