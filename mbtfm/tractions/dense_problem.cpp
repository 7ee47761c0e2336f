#include "mbtfm/tractions/dense_problem.h"

#include <algorithm>

#include "mbtfm/inverse/rows.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::tractions {

DenseProblem::DenseProblem(const DisplacementField& beads, const Compliance& compliance, Index n_loads,
                           const Compliance& truth, Index n_true) {
  check(beads);
  const Index n_rows = 2 * std::ssize(beads);
  if (n_rows < n_loads) {
    throw InvalidData("displacement",
                      "at least " + std::to_string((n_loads + 1) / 2) + " beads for " + std::to_string(n_loads) +
                          " unknown components",
                      std::to_string(beads.size()));
  }
  const inverse::WeightedBeads weighted = inverse::weighted(beads, static_cast<double>(beads.size()));
  stated_variance_ = weighted.stated_variance;
  const std::vector<Vec2> places_um = points_of(beads);
  MatrixXd normal = MatrixXd::Zero(n_loads, n_loads);
  VectorXd adjoint = VectorXd::Zero(n_loads);
  MatrixXd adjoint_of_truth = MatrixXd::Zero(n_loads, n_true);
  constexpr Index kBlock = 2048;  // rows at a time: G as a whole may be too large for memory
  for (Index first = 0; first < n_rows; first += kBlock) {
    const Index n = std::min(kBlock, n_rows - first);
    const auto rows = [&](const Compliance& of) -> MatrixXd {
      const auto begin = places_um.begin() + first / 2;
      return weighted.roots.segment(first, n).asDiagonal() * of({begin, begin + n / 2});
    };
    const MatrixXd G = rows(compliance);
    numerics::add_upper_gram(G, normal);
    adjoint += numerics::transposed_matvec(G, weighted.data.segment(first, n));
    if (n_true > 0) adjoint_of_truth += numerics::small_transposed_product(G, rows(truth));
  }
  spectrum_.emplace(std::move(normal), adjoint, weighted.data.squaredNorm(), static_cast<double>(n_rows));
  projected_truth_ = numerics::small_transposed_product(spectrum_->vectors(), adjoint_of_truth);
}

MatrixXd DenseProblem::response_to_truth(double lambda) const {
  const VectorXd shares = (spectrum_->values() + lambda * lambda).inverse().matrix();
  return numerics::small_product(spectrum_->vectors(), shares.asDiagonal() * projected_truth_);
}

}  // namespace mbtfm::tractions
