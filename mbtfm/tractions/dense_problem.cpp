#include "mbtfm/tractions/dense_problem.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tractions {

using Eigen::Index;

struct DenseProblem::Range {
  std::size_t begin, end;
};

Eigen::MatrixXd DenseProblem::weighted(const Compliance& compliance, const Range& range) const {
  std::vector<Vec2> points;
  for (std::size_t i = range.begin; i < range.end; ++i) points.push_back(beads_[i].position_um);
  Eigen::MatrixXd G = compliance(points);
  for (std::size_t i = range.begin; i < range.end; ++i) {
    G.middleRows<2>(2 * static_cast<Index>(i - range.begin)) *= std::sqrt(weights_[i]);
  }
  return G;
}

template <class Use>
void DenseProblem::for_blocks(const Use& use) const {
  constexpr std::size_t kBlock = 1024;  // beads at a time: G as a whole may be too large for memory
  for (std::size_t begin = 0; begin < beads_.size(); begin += kBlock) {
    const Range range{begin, std::min(begin + kBlock, beads_.size())};
    const Eigen::MatrixXd G = weighted(compliance_, range);
    Eigen::VectorXd u(G.rows());
    for (std::size_t i = begin; i < range.end; ++i) {
      const double root = std::sqrt(weights_[i]);
      u.segment<2>(2 * static_cast<Index>(i - begin)) << root * beads_[i].displacement_um.x,
          root * beads_[i].displacement_um.y;
    }
    use(range, G, u);
  }
}

DenseProblem::DenseProblem(const DisplacementField& beads, Compliance compliance, Index n_loads,
                           const Compliance& truth, Index n_true)
    : beads_(beads), compliance_(std::move(compliance)) {
  check(beads);
  if (2 * static_cast<Index>(beads.size()) < n_loads) {
    throw InvalidData("displacement",
                      "at least " + std::to_string((n_loads + 1) / 2) + " beads for " + std::to_string(n_loads) +
                          " unknown components",
                      std::to_string(beads.size()));
  }
  const bool states_errors = std::all_of(beads.begin(), beads.end(), [](const Bead& b) { return b.sigma_um > 0; });
  double sum = 0;
  for (const Bead& b : beads) {
    weights_.push_back(states_errors ? 1 / (b.sigma_um * b.sigma_um) : 1);
    sum += weights_.back();
  }
  const double mean = sum / static_cast<double>(beads.size());
  for (double& w : weights_) w /= mean;
  if (states_errors) stated_variance_ = 1 / mean;

  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n_loads, n_loads);
  Eigen::VectorXd pulled = Eigen::VectorXd::Zero(n_loads);
  Eigen::MatrixXd pulled_by_truth = Eigen::MatrixXd::Zero(n_loads, n_true);
  for_blocks([&](const Range& range, const Eigen::MatrixXd& G, const Eigen::VectorXd& u) {
    numerics::add_upper_gram(G, normal);
    pulled += G.transpose() * u;
    if (n_true > 0) pulled_by_truth += G.transpose() * weighted(truth, range);
    data_squared_ += u.squaredNorm();
  });
  numerics::mirror_upper(normal);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  eigenvalues_ = eigen.eigenvalues().cwiseMax(0);
  eigenvectors_ = eigen.eigenvectors();
  projected_ = eigenvectors_.transpose() * pulled;
  projected_truth_ = eigenvectors_.transpose() * pulled_by_truth;
}

LambdaScan DenseProblem::scan() const {
  const double largest = std::sqrt(eigenvalues_.maxCoeff());
  // At a tenth of the smallest singular value nothing is smoothed any more; below a millionth of the largest, rounding
  // of the normal matrix is all there is.
  const double smallest = std::max(0.1 * std::sqrt(eigenvalues_.minCoeff()), 1e-6 * largest);
  std::vector<ScanPoint> points;
  const auto n_data = static_cast<double>(2 * beads_.size());
  const Eigen::Array<bool, Eigen::Dynamic, 1> is_felt = eigenvalues_.array() > 1e-12 * largest * largest;
  const auto point_at = [&](double lambda) -> ScanPoint {
    const Eigen::ArrayXd shares = projected_.array() / (eigenvalues_.array() + lambda * lambda);
    return {.lambda = lambda,
            .misfit = misfit(lambda),
            .norm = shares.square().sum(),
            .degrees = (eigenvalues_.array() / (eigenvalues_.array() + lambda * lambda)).sum(),
            .removable_misfit = is_felt.select(shares.square() / eigenvalues_.array(), 0).sum() * std::pow(lambda, 4)};
  };
  for (const double lambda : lambdas_between(largest, smallest)) points.push_back(point_at(lambda));
  // Few loads follow many beads nowhere quite: what they leave, noise or not, is the error of each bead. (Its median,
  // for tractions that follow all but a few, would call most of it signal.)
  return judge(std::move(points), n_data, static_cast<double>(is_felt.count()), stated_variance_, [&](double lambda) {
    const ScanPoint p = point_at(lambda);
    return p.misfit / (n_data - p.degrees);
  });
}

Eigen::VectorXd DenseProblem::solve(double lambda) const {
  return eigenvectors_ * (projected_.array() / (eigenvalues_.array() + lambda * lambda)).matrix();
}

Eigen::MatrixXd DenseProblem::covariance(double lambda, double variance) const {
  const Eigen::ArrayXd shares = eigenvalues_.array() / (eigenvalues_.array() + lambda * lambda).square();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(eigenvectors_.rows(), eigenvectors_.rows());
  numerics::add_upper_outer(eigenvectors_ * (variance * shares).sqrt().matrix().asDiagonal(), covariance);
  numerics::mirror_upper(covariance);
  return covariance;
}

Eigen::MatrixXd DenseProblem::response_to_truth(double lambda) const {
  const Eigen::VectorXd shares = (eigenvalues_.array() + lambda * lambda).inverse().matrix();
  return eigenvectors_ * (shares.asDiagonal() * projected_truth_);
}

double DenseProblem::misfit(double lambda) const {
  const Eigen::ArrayXd shares = projected_.array() / (eigenvalues_.array() + lambda * lambda);
  return data_squared_ - 2 * (shares * projected_.array()).sum() + (eigenvalues_.array() * shares.square()).sum();
}

double DenseProblem::relative_l2(double lambda) const {
  return data_squared_ > 0 ? std::sqrt(std::max(0.0, misfit(lambda)) / data_squared_) : 0;
}

}  // namespace mbtfm::tractions
