#include "mbtfm/tractions/recurrences.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "pipeline/numerics/dense.h"

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
  Index size() const { return std::ssize(alpha); }
  MatrixXd bidiagonal() const {
    MatrixXd b = MatrixXd::Zero(size() + 1, size());
    for (Index j = 0; j < size(); ++j) {
      b(j, j) = alpha[static_cast<std::size_t>(j)];
      if (j < std::ssize(beta)) b(j + 1, j) = beta[static_cast<std::size_t>(j)];
    }
    return b;
  }
  /// The problem in this basis, whose data is start e_1.
  Spectrum small(double n_data) const {
    const MatrixXd b = bidiagonal();
    return {b.transpose() * b, start * b.row(0).transpose(), start * start, n_data};
  }
};

/// A on the space of all right vectors V together. They are far from independent: an orthonormal basis of the space is
/// V E D^(-1/2), VᵀV = E D Eᵀ, without what rounding left of it; and A V = U B is known.
Spectrum joint(const std::vector<Recurrence>& all, const VectorXd& data, double n_data) {
  constexpr double kIndependent = 1e-9;  // of the largest: V has unit columns, and D an error of 1e-16 of it
  Index n = 0;
  for (const Recurrence& r : all) n += r.size();
  MatrixXd right(all.front().right.rows(), n), moved(data.size(), n);
  Index at = 0;
  for (const Recurrence& r : all) {
    right.middleCols(at, r.size()) = r.right.leftCols(r.size());
    moved.middleCols(at, r.size()) = r.left.leftCols(r.size() + 1) * r.bidiagonal();
    at += r.size();
  }
  const auto [values, vectors] = numerics::symmetric_eigen(numerics::gram(right));
  const auto n_kept = static_cast<Index>((values.array() > kIndependent * values.maxCoeff()).count());
  // rising: those kept are the last
  const MatrixXd to_basis = vectors.rightCols(n_kept) * values.tail(n_kept).cwiseSqrt().cwiseInverse().asDiagonal();
  const MatrixXd of_basis = moved * to_basis;
  return {numerics::gram(of_basis), of_basis.transpose() * data, data.squaredNorm(), n_data};
}

}  // namespace

Recurrences::Recurrences(const LinearMap& map, const VectorXd& data, const RecurrenceOptions& options) {
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
  const auto n_data = static_cast<double>(map.n_data);
  basis_ = all.front().right.leftCols(all.front().size());
  of_data_.emplace(all.front().small(n_data));
  joint_.emplace(joint(all, data, n_data));
}

}  // namespace mbtfm::tractions
