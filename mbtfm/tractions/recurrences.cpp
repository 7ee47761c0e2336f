#include "mbtfm/tractions/recurrences.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace mbtfm::tractions {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// A V = U B, Aᵀ U = V Bᵀ with B lower bidiagonal.
struct Recurrence {
  MatrixXd left, right;  ///< U, V
  std::vector<double> alpha, beta;
  double start = 0;  ///< length of the vector it starts from
  bool is_done = false;

  /// Twice is enough (Parlett, The Symmetric Eigenvalue Problem, 6.9).
  static void make_orthogonal(VectorXd& v, const MatrixXd& to, Index n) {
    for (int pass = 0; pass < 2; ++pass) v -= to.leftCols(n) * (to.leftCols(n).transpose() * v);
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
    : n_data_(static_cast<double>(map.n_data)), n_felt_(static_cast<double>(std::min(map.n_data, map.n_unknowns))) {
  constexpr double kNothing = 1e-13;  // of the first: what is left is rounding
  const auto n = static_cast<std::size_t>(1 + options.probes);
  const auto steps = std::min<Index>(options.steps, std::min(map.n_data, map.n_unknowns));
  std::vector<Recurrence> all(n);
  MatrixXd block(map.n_data, static_cast<Index>(n));
  block.col(0) = data;
  std::mt19937_64 random(options.seed);
  for (Index k = 1; k < block.cols(); ++k) {
    for (Index i = 0; i < map.n_data; ++i) block(i, k) = random() >> 63 ? 1 : -1;
  }
  for (std::size_t k = 0; k < n; ++k) {
    Recurrence& r = all[k];
    r.start = block.col(static_cast<Index>(k)).norm();
    r.is_done = r.start == 0;
    r.left = MatrixXd::Zero(map.n_data, steps + 1);
    r.right = MatrixXd::Zero(map.n_unknowns, steps);
    if (!r.is_done) r.left.col(0) = block.col(static_cast<Index>(k)) / r.start;
  }
  for (Index j = 0; j < steps; ++j) {
    for (std::size_t k = 0; k < n; ++k) block.col(static_cast<Index>(k)) = all[k].left.col(j);
    MatrixXd pulled = map.transposed(block);
    for (std::size_t k = 0; k < n; ++k) {
      Recurrence& r = all[k];
      if (r.is_done) continue;
      VectorXd v = pulled.col(static_cast<Index>(k));
      Recurrence::make_orthogonal(v, r.right, j);
      const double alpha = v.norm();
      r.is_done = !(alpha > kNothing * (r.alpha.empty() ? 0 : r.alpha.front())) || alpha == 0;
      if (r.is_done) continue;
      r.alpha.push_back(alpha);
      r.right.col(j) = v / alpha;
    }
    MatrixXd right(map.n_unknowns, static_cast<Index>(n));
    for (std::size_t k = 0; k < n; ++k) right.col(static_cast<Index>(k)) = all[k].right.col(j);
    MatrixXd moved = map.forward(right);
    for (std::size_t k = 0; k < n; ++k) {
      Recurrence& r = all[k];
      if (r.is_done) continue;
      VectorXd u = moved.col(static_cast<Index>(k));
      Recurrence::make_orthogonal(u, r.left, j + 1);
      const double beta = u.norm();
      r.is_done = !(beta > kNothing * r.alpha.front());
      r.beta.push_back(r.is_done ? 0 : beta);
      if (!r.is_done) r.left.col(j + 1) = u / beta;
    }
  }
  basis_ = all.front().right.leftCols(std::ssize(all.front().alpha));
  for (const Recurrence& r : all) small_.push_back(r.small(n_data_));
}

double Recurrences::degrees(double lambda) const {
  double sum = 0;
  for (std::size_t k = 1; k < small_.size(); ++k) sum += small_[k].explained(lambda);
  return std::min(sum / static_cast<double>(small_.size() - 1), n_felt_);
}

LambdaScan Recurrences::scan(std::optional<double> stated_variance) const {
  const Spectrum& data = small_.front();
  // the least values of the small problem have not settled: below a thousandth of the largest, lambda would hang on
  // them
  const double largest = std::sqrt(data.values().maxCoeff());
  const double smallest = std::max(0.1 * std::sqrt(data.values().minCoeff()), 1e-3 * largest);
  std::vector<ScanPoint> points;
  for (const double lambda : lambdas_between(largest, smallest)) {
    ScanPoint point = data.point_at(lambda);
    point.degrees = degrees(lambda);
    points.push_back(point);
  }
  const Risks risks = [&](const std::vector<ScanPoint>& scanned, double variance) {
    std::vector<double> values;
    for (const ScanPoint& p : scanned)
      values.push_back(unbiased_risk(p, data.removable_misfit(p.lambda), n_felt_, variance));
    return values;
  };
  return judge(
      std::move(points), n_data_, stated_variance,
      [&](double lambda) { return misfit(lambda) / (n_data_ - degrees(lambda)); }, risks);
}

}  // namespace mbtfm::tractions
