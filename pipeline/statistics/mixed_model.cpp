#include "pipeline/statistics/mixed_model.h"

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::statistics {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;

/// A variance component: a random effect shared by the observations of a cell (and of one kind), or the scatter of a
/// kind.
enum class Term { cell, cell_kind, residual };
struct Component {
  Term term = Term::residual;
  int kind = 0;  ///< of a residual
};

/// Which columns of Z a cell has, those of its kinds. The covariance of the data is V = D + Z L Zᵀ.
struct Block {
  Index first = 0, size = 0;
};

struct Design {
  std::vector<Observation> rows = {};  ///< by cell
  std::vector<Block> blocks = {};      ///< by cell
  MatrixXd X;                          ///< 1 where the row is of the group
  SparseMatrix of_cell, Z;             ///< 1 where the row is of the cell; where it is of the cell and kind
  VectorXd y = {};
  std::vector<Component> components;
  std::vector<bool> is_scatter_identifiable;  ///< by kind: a group has two observations of it
  double smallest_residual = 0;

  int n_kinds() const { return static_cast<int>(is_scatter_identifiable.size()); }
};

void check_data(const std::vector<Observation>& observations) {
  std::set<int> cells;
  std::set<double> values;
  for (const Observation& o : observations) {
    cells.insert(o.cell);
    values.insert(o.value);
  }
  if (cells.size() < 2) throw InvalidData("the sample", "two cells at least", std::to_string(cells.size()));
  if (values.size() < 2) throw InvalidData("the sample", "values that differ", "all equal");
}

/// Without scatter within groups and without errors nothing shows how well the means are known.
void check_scatter(const Design& design) {
  const VectorXd n = design.X.colwise().sum();
  const VectorXd means = (design.X.transpose() * design.y).cwiseQuotient(n);
  constexpr double kRounding = 1e-12;  // of the values
  const double scatter = (design.y - design.X * means).cwiseAbs().maxCoeff();
  const bool has_errors = std::ranges::any_of(design.rows, [](const Observation& o) { return o.error_variance > 0; });
  if (has_errors || scatter > kRounding * design.y.cwiseAbs().maxCoeff()) return;
  throw InvalidData("the sample", "values that differ within a group, or errors", "neither");
}

/// Blocks and their columns.
void add_blocks(Design& design) {
  std::vector<Eigen::Triplet<double>> of_cell, of_kind;
  std::map<int, Index> column_of;  // by kind, of one cell
  for (Index i = 0; i < static_cast<Index>(design.rows.size()); ++i) {
    const Observation& o = design.rows[i];
    if (i == 0 || o.cell != design.rows[i - 1].cell) {
      design.blocks.push_back({.first = i == 0 ? 0 : design.blocks.back().first + design.blocks.back().size});
      column_of.clear();
    }
    Block& block = design.blocks.back();
    const auto [at, is_new] = column_of.try_emplace(o.kind, block.first + block.size);
    if (is_new) ++block.size;
    of_cell.emplace_back(i, std::ssize(design.blocks) - 1, 1);
    of_kind.emplace_back(i, at->second, 1);
  }
  design.of_cell.resize(std::ssize(design.rows), std::ssize(design.blocks));
  design.of_cell.setFromTriplets(of_cell.begin(), of_cell.end());
  design.Z.resize(std::ssize(design.rows), design.blocks.back().first + design.blocks.back().size);
  design.Z.setFromTriplets(of_kind.begin(), of_kind.end());
}

bool has_group_of_two_cells(const std::vector<Observation>& rows) {
  std::map<int, int> cell_of;  // the first of each group
  return std::ranges::any_of(
      rows, [&](const Observation& o) { return cell_of.try_emplace(o.group, o.cell).first->second != o.cell; });
}

std::vector<bool> identifiable_scatter(const std::vector<Observation>& rows) {
  int n_kinds = 0;
  for (const Observation& o : rows) n_kinds = std::max(n_kinds, o.kind + 1);
  std::map<std::pair<int, int>, int> n_of;  // group, kind
  std::vector<bool> is_identifiable(static_cast<std::size_t>(n_kinds), false);
  for (const Observation& o : rows)
    if (++n_of[{o.group, o.kind}] > 1) is_identifiable[o.kind] = true;
  return is_identifiable;
}

/// The random effects that the design can distinguish from the scatter and from each other.
std::vector<Component> components_of(const Design& design) {
  const std::vector<Observation>& rows = design.rows;
  const Index n = design.Z.rows(), n_of_kind = design.Z.cols(), n_cells = design.of_cell.cols();
  std::vector<Component> components;
  if (has_group_of_two_cells(rows) && n > n_cells) components.push_back({.term = Term::cell});
  if (has_group_of_two_cells(rows) && n_of_kind > n_cells && n > n_of_kind)
    components.push_back({.term = Term::cell_kind});
  std::set<int> kinds;
  for (const Observation& o : rows) kinds.insert(o.kind);
  for (const int kind : kinds) components.push_back({.term = Term::residual, .kind = kind});
  return components;
}

Design design_of(std::vector<Observation> observations) {
  check_data(observations);
  Design design;
  design.rows = std::move(observations);
  std::ranges::stable_sort(design.rows, [](const Observation& a, const Observation& b) { return a.cell < b.cell; });
  add_blocks(design);
  design.components = components_of(design);
  design.is_scatter_identifiable = identifiable_scatter(design.rows);
  const Index n = static_cast<Index>(design.rows.size());
  int n_groups = 0;
  for (const Observation& o : design.rows) n_groups = std::max(n_groups, o.group + 1);
  design.X = MatrixXd::Zero(n, n_groups);
  design.y.resize(n);
  for (Index i = 0; i < n; ++i) {
    design.X(i, design.rows[i].group) = 1;
    design.y[i] = design.rows[i].value;
  }
  for (int g = 0; g < n_groups; ++g)
    if (design.X.col(g).sum() == 0) throw InvalidData("group " + std::to_string(g), "an observation", "none");
  check_scatter(design);
  // V must stay invertible where a kind does not scatter and its errors are not known
  constexpr double kSmallest = 1e-8;
  design.smallest_residual = kSmallest * (design.y.array() - design.y.mean()).square().mean();
  return design;
}

/// V⁻¹ by blocks. Z has a column for each kind of the cell, whose effects have the covariance L: a shared by all and b
/// of each. With A = Zᵀ D⁻¹ Z, which is diagonal, and M = (L + A⁻¹)⁻¹ = Zᵀ V⁻¹ Z,
///
///   V⁻¹ = D⁻¹ − D⁻¹ Z A⁻¹ Zᵀ D⁻¹ + D⁻¹ Z A⁻¹ M A⁻¹ Zᵀ D⁻¹:
///
/// deviations from the means of cell and kind, and these means. (Woodbury's formula would lose all digits where the
/// scatter within is small.)
class Covariance {
 public:
  Covariance(const Design& design, const VectorXd& v) : design_(&design), weight_(design.y.size()) {
    double of_cell = 0, of_cell_kind = 0;
    VectorXd residual = VectorXd::Zero(design.n_kinds());
    for (std::size_t k = 0; k < design.components.size(); ++k) {
      const Component& c = design.components[k];
      (c.term == Term::cell        ? of_cell
       : c.term == Term::cell_kind ? of_cell_kind
                                   : residual[c.kind]) = v[static_cast<Index>(k)];
    }
    for (Index i = 0; i < weight_.size(); ++i) {
      const Observation& o = design.rows[i];
      weight_[i] = 1 / (residual[o.kind] + o.error_variance);
      log_determinant_ -= std::log(weight_[i]);
    }
    const VectorXd A = design.Z.transpose() * weight_;
    share_ = weight_.cwiseQuotient(design.Z * A);
    for (const auto& [first, size] : design.blocks) {
      const VectorXd own = A.segment(first, size);
      MatrixXd of_means = MatrixXd::Constant(size, size, of_cell);
      of_means.diagonal() += own.cwiseInverse() + VectorXd::Constant(size, of_cell_kind);
      const Eigen::LLT<MatrixXd> llt(of_means);
      log_determinant_ += own.array().log().sum() + 2 * llt.matrixLLT().diagonal().array().log().sum();
      M_.push_back(llt.solve(MatrixXd::Identity(size, size)));
    }
  }
  double log_determinant() const { return log_determinant_; }

  MatrixXd solve(const MatrixXd& m) const {
    const MatrixXd means = design_->Z.transpose() * MatrixXd(share_.asDiagonal() * m);
    MatrixXd solved(means.rows(), means.cols());
    for (std::size_t b = 0; b < M_.size(); ++b) {
      const auto& [first, size] = design_->blocks[b];
      solved.middleRows(first, size) = M_[b] * means.middleRows(first, size);
    }
    return weight_.asDiagonal() * (m - design_->Z * means) + share_.asDiagonal() * (design_->Z * solved);
  }

  /// tr(V⁻¹ V_k), V_k the derivative of V by the component's variance.
  double trace(const Component& component) const {
    double sum = 0;
    VectorXd diagonal(design_->Z.cols());  // of M
    for (std::size_t b = 0; b < M_.size(); ++b) {
      if (component.term == Term::cell) sum += M_[b].sum();
      if (component.term == Term::cell_kind) sum += M_[b].trace();
      diagonal.segment(design_->blocks[b].first, design_->blocks[b].size) = M_[b].diagonal();
    }
    if (component.term != Term::residual) return sum;
    const VectorXd by_row = design_->Z * diagonal;
    for (Index i = 0; i < by_row.size(); ++i)
      if (design_->rows[i].kind == component.kind)
        sum += weight_[i] * (1 - share_[i]) + share_[i] * share_[i] * by_row[i];
    return sum;
  }

 private:
  const Design* design_;
  VectorXd weight_;          ///< D⁻¹
  VectorXd share_;           ///< of a row in the mean of its cell and kind
  std::vector<MatrixXd> M_;  ///< by block
  double log_determinant_ = 0;
};

/// V_k m.
MatrixXd derivative_times(const Design& design, const Component& component, const MatrixXd& m) {
  if (component.term == Term::residual) {
    VectorXd is_of_kind(m.rows());
    for (Index i = 0; i < m.rows(); ++i) is_of_kind[i] = design.rows[i].kind == component.kind ? 1 : 0;
    return is_of_kind.asDiagonal() * m;
  }
  const SparseMatrix& of = component.term == Term::cell ? design.of_cell : design.Z;
  return of * MatrixXd(of.transpose() * m);
}

/// The likelihood at given variances, with all that its derivatives need.
struct State {
  VectorXd v;
  Covariance inverse;
  MatrixXd W = {};             ///< V⁻¹ X
  MatrixXd C = {};             ///< (Xᵀ V⁻¹ X)⁻¹
  VectorXd mean = {}, r = {};  ///< r = V⁻¹ (y − X mean) = P y
  double log_likelihood = 0;
};

State state_at(const Design& design, const VectorXd& v) {
  State s{.v = v, .inverse = Covariance(design, v)};
  s.W = s.inverse.solve(design.X);
  const MatrixXd information = design.X.transpose() * s.W;
  const Eigen::LLT<MatrixXd> llt(information);
  const Index p = information.rows();
  s.C = llt.solve(MatrixXd::Identity(p, p));
  s.mean = s.C * (s.W.transpose() * design.y);
  const VectorXd residual = design.y - design.X * s.mean;
  s.r = s.inverse.solve(residual);
  const double log_det_information = 2 * llt.matrixLLT().diagonal().array().log().sum();
  const double n = static_cast<double>(design.y.size() - p);
  s.log_likelihood = -0.5 * (s.inverse.log_determinant() + log_det_information + residual.dot(s.r) +
                             n * std::log(2 * std::numbers::pi));
  return s;
}

struct Derivatives {
  VectorXd gradient;
  MatrixXd information;                    // average of observed and expected
  std::vector<MatrixXd> mean_slopes = {};  // of C by each variance
};
Derivatives derivatives_at(const Design& design, const State& s) {
  const Index n = static_cast<Index>(design.components.size());
  Derivatives d{.gradient = VectorXd(n), .information = MatrixXd(n, n)};
  MatrixXd Vr(design.y.size(), n);
  for (Index k = 0; k < n; ++k) {
    const Component& component = design.components[k];
    const MatrixXd both =
        derivative_times(design, component, (MatrixXd(s.W.rows(), s.W.cols() + 1) << s.W, s.r).finished());
    const MatrixXd WVW = s.W.transpose() * both.leftCols(s.W.cols());
    Vr.col(k) = both.rightCols(1);
    const double trace = s.inverse.trace(component) - (s.C * WVW).trace();
    d.gradient[k] = 0.5 * (s.r.dot(Vr.col(k)) - trace);
    d.mean_slopes.push_back(s.C * WVW * s.C);
  }
  const MatrixXd PVr = s.inverse.solve(Vr) - s.W * (s.C * (s.W.transpose() * Vr));
  d.information = 0.5 * Vr.transpose() * PVr;
  return d;
}

/// Which variances may move: not those at their lower end whose likelihood falls on leaving it.
std::vector<Index> free_ones(const VectorXd& v, const VectorXd& lower, const VectorXd& gradient) {
  std::vector<Index> list;
  for (Index k = 0; k < v.size(); ++k)
    if (v[k] > lower[k] || gradient[k] > 0) list.push_back(k);
  return list;
}

MatrixXd part(const MatrixXd& m, const std::vector<Index>& which) { return m(which, which); }

/// To the maximum of the likelihood's second order, none below its lower end: what meets it stays there, and the others
/// move on without it.
VectorXd newton_step(const Derivatives& d, const VectorXd& v, const VectorXd& lower, std::vector<Index> free) {
  VectorXd step = VectorXd::Zero(v.size());
  while (!free.empty()) {
    const VectorXd g = (d.gradient - d.information * step)(free);
    const VectorXd of_free = numerics::shortest_solution(part(d.information, free), g);
    std::vector<Index> left;
    VectorXd next = step;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const Index k = free[i];
      const bool is_met = v[k] + of_free[static_cast<Index>(i)] < lower[k];
      next[k] = is_met ? lower[k] - v[k] : of_free[static_cast<Index>(i)];
      if (!is_met) left.push_back(k);
    }
    if (left.size() == free.size()) return next;
    for (const Index k : left) next[k] = 0;
    step = next;
    free = left;
  }
  return step;
}

/// Uphill, for where Newton's step misses: the residuals may be so far below their errors that they show next to
/// nothing of the curvature. About as long as the expected one wants it, which for n levels of variance w is n / 2 w².
VectorXd uphill_step(const Design& design, const State& s, const Derivatives& d) {
  double error = 0;
  for (const Observation& o : design.rows) error += o.error_variance / static_cast<double>(design.rows.size());
  VectorXd step(d.gradient.size());
  for (Index k = 0; k < step.size(); ++k) {
    const Component& c = design.components[k];
    const Index n_levels = c.term == Term::cell        ? design.of_cell.cols()
                           : c.term == Term::cell_kind ? design.Z.cols()
                                                       : design.Z.rows();
    step[k] = 2 * std::pow(s.v[k] + error, 2) * d.gradient[k] / static_cast<double>(n_levels);
  }
  return step;
}

/// The first state along a step that is no worse, none below the lower ends; none where there is none.
std::optional<State> climb(const Design& design, const State& s, const VectorXd& step, const VectorXd& lower) {
  constexpr double kShortest = 1e-6;
  for (double share = 1; share > kShortest; share /= 2) {
    State next = state_at(design, (s.v + share * step).cwiseMax(lower));
    if (next.log_likelihood >= s.log_likelihood) return next;
  }
  return std::nullopt;
}

/// Of the estimates of these variances; of none, where all are held at zero, none.
MatrixXd covariance_of_estimates(const MatrixXd& information, const std::vector<Index>& estimated) {
  if (estimated.empty()) return {};
  return numerics::pseudo_inverse(part(information, estimated));
}

/// The variances into the fit, with what the degrees of freedom need of those that are not held at zero.
void add_variances(const Design& design, const State& s, const Derivatives& d, const VectorXd& lower, MixedFit& fit) {
  fit.residual_variance.resize(static_cast<std::size_t>(design.n_kinds()));
  std::vector<Index> estimated;
  for (Index k = 0; k < s.v.size(); ++k) {
    const Component& component = design.components[k];
    const bool is_held = s.v[k] <= lower[k];
    const double variance = is_held ? 0 : s.v[k];
    const auto kind = static_cast<std::size_t>(component.kind);
    if (component.term == Term::cell) fit.cell_variance = variance;
    if (component.term == Term::cell_kind) fit.cell_kind_variance = variance;
    if (component.term == Term::residual && !design.is_scatter_identifiable[kind]) continue;
    if (component.term == Term::residual) fit.residual_variance[kind] = variance;
    if (is_held) continue;
    estimated.push_back(k);
    fit.covariance_slopes.push_back(d.mean_slopes[k]);
  }
  fit.variance_covariance = covariance_of_estimates(d.information, estimated);
}

}  // namespace

MixedFit fit_mixed_model(std::vector<Observation> observations) {
  const Design design = design_of(std::move(observations));
  const Index n = static_cast<Index>(design.components.size());
  VectorXd lower = VectorXd::Zero(n), start(n);
  const double variance = (design.y.array() - design.y.mean()).square().mean();
  for (Index k = 0; k < n; ++k) {
    const bool is_residual = design.components[k].term == Term::residual;
    if (is_residual) lower[k] = design.smallest_residual;
    start[k] = (is_residual ? 0.5 : 0.2) * variance;
  }
  State s = state_at(design, start);
  MixedFit fit;
  constexpr int kMaxSteps = 200;       // some ten do but where a variance creeps towards zero
  constexpr double kTolerance = 1e-9;  // of the log-likelihood: nothing that anyone reads changes
  Derivatives d = derivatives_at(design, s);
  for (int i = 0; i < kMaxSteps && !fit.converged; ++i) {
    std::optional<State> next = climb(design, s, newton_step(d, s.v, lower, free_ones(s.v, lower, d.gradient)), lower);
    if (!next) next = climb(design, s, uphill_step(design, s, d), lower);
    const double gain = next ? next->log_likelihood - s.log_likelihood : 0;
    if (next) s = std::move(*next);
    d = derivatives_at(design, s);
    // half of what a full Newton step promises
    const double promise = 0.5 * newton_step(d, s.v, lower, free_ones(s.v, lower, d.gradient)).dot(d.gradient);
    fit.converged = gain < kTolerance && promise < kTolerance;
  }
  fit.mean = s.mean;
  fit.covariance = s.C;
  fit.log_likelihood = s.log_likelihood;
  fit.n_cells = static_cast<int>(design.blocks.size());
  fit.n_observations = static_cast<int>(design.rows.size());
  add_variances(design, s, d, lower, fit);
  return fit;
}

}  // namespace mbtfm::statistics
