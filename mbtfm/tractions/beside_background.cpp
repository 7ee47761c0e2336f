#include "mbtfm/tractions/beside_background.h"

#include <algorithm>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::tractions {

namespace {
constexpr double kRounding = 1e-7;  // of a block: directions smaller than this are rounding
}

BesideBackground::BesideBackground(const LatticeProblem& problem, const MatrixXd& D, int threads)
    : problem_(problem), threads_(threads) {
  MatrixXd Y(D.rows(), D.cols() + 1);
  Y << D, problem.data();
  const VectorXd lengths = Y.colwise().norm();
  Y.array().rowwise() /= lengths.transpose().array();
  basis_ = numerics::principal_directions(Y, kRounding);
  start_ = numerics::transposed_product(basis_, Y, threads) * lengths.asDiagonal();
}

BesideBackground::Normal BesideBackground::at(double m) {
  constexpr double kEnough = 1e-5;  // of any number on the diagonal, by the next block if changes go on to fall alike
  MatrixXd found = product_at(m, 0);
  double change = 1;
  for (std::size_t n_blocks = 1;; ++n_blocks) {
    if (n_blocks > diagonal_.size()) add_block();
    const MatrixXd before = std::exchange(found, product_at(m, n_blocks));
    const double last =
        std::exchange(change, ((found - before).diagonal().array().abs() / found.diagonal().array()).maxCoeff());
    if (change * change <= kEnough * last || (is_complete() && n_blocks == diagonal_.size())) break;
  }
  const Index n = found.cols() - 1;
  return {.matrix = found.topLeftCorner(n, n), .right = found.col(n).head(n)};
}

MatrixXd BesideBackground::times_S(const MatrixXd& columns) const {
  constexpr int kEach = 16;  // columns that share their memory: fresh memory costs more than the transforms
  const int n = static_cast<int>(columns.cols());
  const WaveTransform& transform = problem_.transform();
  MatrixXd result(columns.rows(), n);
  numerics::parallel_for((n + kEach - 1) / kEach, threads_, [&](int part) {
    WaveField waves = transform.no_waves();
    NodeField nodes;
    for (int k = kEach * part; k < std::min(n, kEach * (part + 1)); ++k) {
      nodes = problem_.spread_of(columns.col(k), std::move(nodes));
      transform.forward(nodes, waves, 1);
      problem_.spectrum().displace(waves);
      problem_.spectrum().displace(waves);
      transform.backward(waves, nodes, 1);
      result.col(k) = problem_.at_beads(nodes);
    }
  });
  return result;
}

void BesideBackground::add_block() {
  MatrixXd next = times_S(basis_);
  if (!below_.empty()) next -= numerics::product(before_, below_.back().transpose(), threads_);
  const MatrixXd A = numerics::transposed_product(basis_, next, threads_);
  next -= numerics::product(basis_, A, threads_);
  diagonal_.push_back(0.5 * (A + A.transpose()));
  before_ = std::move(basis_);
  basis_ = numerics::principal_directions(next, kRounding);
  below_.push_back(numerics::transposed_product(basis_, next, threads_));
}

MatrixXd BesideBackground::product_at(double m, std::size_t n_blocks) const {
  const double share = 1 / (m * m);
  MatrixXd inner;  // B_jᵀ M_{j+1}⁻¹ B_j, at last Rᵀ M_1⁻¹ R
  if (n_blocks == 0) return numerics::gram(start_, threads_);
  for (std::size_t j = n_blocks; j-- > 0;) {
    MatrixXd M = share * diagonal_[j];
    M.diagonal().array() += 1;
    if (j + 1 < n_blocks) M -= share * share * inner;
    const bool is_definite = numerics::upper_cholesky(M, threads_);
    MBTFM_ASSERT(is_definite);
    MatrixXd solved = j > 0 ? below_[j - 1] : start_;
    numerics::solve_upper_transposed(M, solved, threads_);
    inner = numerics::gram(solved, threads_);
  }
  return inner;
}

}  // namespace mbtfm::tractions
