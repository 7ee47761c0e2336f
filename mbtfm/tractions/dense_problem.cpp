#include "mbtfm/tractions/dense_problem.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tractions {

struct DenseProblem::Range {
  std::size_t begin, end;
};

MatrixXd DenseProblem::weighted(const Compliance& compliance, const Range& range) const {
  std::vector<Vec2> points;
  for (std::size_t i = range.begin; i < range.end; ++i) points.push_back(beads_[i].position_um);
  MatrixXd G = compliance(points);
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
    const MatrixXd G = weighted(compliance_, range);
    VectorXd u(G.rows());
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
  const bool states_errors = state_errors(beads);
  double sum = 0;
  for (const Bead& b : beads) {
    weights_.push_back(states_errors ? 1 / (b.sigma_um * b.sigma_um) : 1);
    sum += weights_.back();
  }
  const double mean = sum / static_cast<double>(beads.size());
  for (double& w : weights_) w /= mean;
  if (states_errors) stated_variance_ = 1 / mean;

  double data_squared = 0;
  MatrixXd normal = MatrixXd::Zero(n_loads, n_loads);
  VectorXd pulled = VectorXd::Zero(n_loads);
  MatrixXd pulled_by_truth = MatrixXd::Zero(n_loads, n_true);
  for_blocks([&](const Range& range, const MatrixXd& G, const VectorXd& u) {
    numerics::add_upper_gram(G, normal);
    pulled += numerics::transposed_matvec(G, u);
    if (n_true > 0) pulled_by_truth += numerics::small_transposed_product(G, weighted(truth, range));
    data_squared += u.squaredNorm();
  });
  spectrum_.emplace(std::move(normal), std::move(pulled), data_squared, static_cast<double>(2 * beads.size()));
  projected_truth_ = numerics::small_transposed_product(spectrum_->vectors(), pulled_by_truth);
}

MatrixXd DenseProblem::response_to_truth(double lambda) const {
  const VectorXd shares = (spectrum_->values() + lambda * lambda).inverse().matrix();
  return numerics::small_product(spectrum_->vectors(), shares.asDiagonal() * projected_truth_);
}

}  // namespace mbtfm::tractions
