#include "pipeline/statistics/mixed_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pipeline/contract/errors.h"

namespace mbtfm::statistics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A variance component: a random effect shared by the observations of a cell (and of one kind), or the scatter of a
/// kind.
enum class Term { cell, cell_kind, residual };
struct Component {
  Term term = Term::residual;
  int kind = 0;  ///< of a residual
};

/// Of a cell's block of the covariance of the data, V = D + Z L Zᵀ: which columns of Z its rows have.
struct Block {
  Index first = 0, size = 0;
  int n_kinds = 0;                 ///< that it has
  std::vector<int> kind_column{};  ///< by row
};

struct Design {
  std::vector<Observation> rows;  ///< by cell
  std::vector<Block> blocks;
  MatrixXd X;  ///< 1 where the row is of the group
  VectorXd y;
  std::vector<Component> components;
  double smallest_residual = 0;
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

std::vector<Block> blocks_of(const std::vector<Observation>& rows) {
  std::vector<Block> blocks;
  std::map<int, int> column_of;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i == 0 || rows[i].cell != rows[i - 1].cell) {
      blocks.push_back({.first = static_cast<Index>(i)});
      column_of.clear();
    }
    Block& block = blocks.back();
    ++block.size;
    const auto [at, is_new] = column_of.try_emplace(rows[i].kind, static_cast<int>(column_of.size()));
    block.kind_column.push_back(at->second);
    block.n_kinds = static_cast<int>(column_of.size());
  }
  return blocks;
}

/// The random effects that the design can tell from the scatter and from each other.
std::vector<Component> components_of(const std::vector<Observation>& rows, const std::vector<Block>& blocks) {
  const bool has_two_in_a_cell = std::any_of(blocks.begin(), blocks.end(), [](const Block& b) { return b.size > 1; });
  const bool has_two_kinds = std::any_of(blocks.begin(), blocks.end(), [](const Block& b) { return b.n_kinds > 1; });
  const bool has_two_of_a_kind =
      std::any_of(blocks.begin(), blocks.end(), [](const Block& b) { return b.size > b.n_kinds; });
  std::vector<Component> components;
  if (has_two_in_a_cell) components.push_back({.term = Term::cell});
  if (has_two_kinds && has_two_of_a_kind) components.push_back({.term = Term::cell_kind});
  int n_kinds = 0;
  for (const Observation& o : rows) n_kinds = std::max(n_kinds, o.kind + 1);
  for (int k = 0; k < n_kinds; ++k) components.push_back({.term = Term::residual, .kind = k});
  return components;
}

Design design_of(std::vector<Observation> observations) {
  check_data(observations);
  Design design;
  design.rows = std::move(observations);
  std::stable_sort(design.rows.begin(), design.rows.end(),
                   [](const Observation& a, const Observation& b) { return a.cell < b.cell; });
  design.blocks = blocks_of(design.rows);
  design.components = components_of(design.rows, design.blocks);
  const Index n = static_cast<Index>(design.rows.size());
  int n_groups = 0;
  for (const Observation& o : design.rows) n_groups = std::max(n_groups, o.group + 1);
  design.X = MatrixXd::Zero(n, n_groups);
  design.y.resize(n);
  for (Index i = 0; i < n; ++i) {
    design.X(i, design.rows[static_cast<std::size_t>(i)].group) = 1;
    design.y[i] = design.rows[static_cast<std::size_t>(i)].value;
  }
  for (int g = 0; g < n_groups; ++g) {
    if (design.X.col(g).sum() == 0) throw InvalidData("group " + std::to_string(g), "an observation", "none");
  }
  // V must stay invertible where a kind does not scatter and its errors are not known
  constexpr double kSmallest = 1e-8;
  design.smallest_residual = kSmallest * (design.y.array() - design.y.mean()).square().mean();
  return design;
}

/// Z of a block: a column for the cell, one for each of its kinds; and the variance of each column's effect.
struct Effects {
  MatrixXd Z;
  VectorXd variance;
};
Effects effects_of(const Design& design, const Block& block, const VectorXd& v) {
  Effects effects{.Z = MatrixXd::Zero(block.size, 1 + block.n_kinds), .variance = VectorXd::Zero(1 + block.n_kinds)};
  effects.Z.col(0).setOnes();
  for (Index i = 0; i < block.size; ++i) effects.Z(i, 1 + block.kind_column[static_cast<std::size_t>(i)]) = 1;
  for (std::size_t k = 0; k < design.components.size(); ++k) {
    if (design.components[k].term == Term::cell) effects.variance[0] = v[static_cast<Index>(k)];
    if (design.components[k].term == Term::cell_kind)
      effects.variance.tail(block.n_kinds).setConstant(v[static_cast<Index>(k)]);
  }
  return effects;
}

/// V⁻¹ by blocks (Woodbury): D⁻¹ − D⁻¹ Z (I + L Zᵀ D⁻¹ Z)⁻¹ L Zᵀ D⁻¹.
class Covariance {
 public:
  Covariance(const Design& design, const VectorXd& v) : design_(&design), d_(design.y.size()) {
    VectorXd residual = VectorXd::Zero(static_cast<Index>(design.components.size()));
    for (std::size_t k = 0; k < design.components.size(); ++k) {
      if (design.components[k].term == Term::residual) residual[design.components[k].kind] = v[static_cast<Index>(k)];
    }
    for (Index i = 0; i < d_.size(); ++i) {
      const Observation& o = design.rows[static_cast<std::size_t>(i)];
      d_[i] = residual[o.kind] + o.error_variance;
      log_determinant_ += std::log(d_[i]);
    }
    for (const Block& block : design.blocks) {
      const Effects effects = effects_of(design, block, v);
      const MatrixXd scaled = d_.segment(block.first, block.size).cwiseInverse().asDiagonal() * effects.Z;
      const MatrixXd L = effects.variance.asDiagonal();
      const Index q = effects.variance.size();
      const Eigen::PartialPivLU<MatrixXd> inner(MatrixXd::Identity(q, q) + L * effects.Z.transpose() * scaled);
      log_determinant_ += std::log(std::abs(inner.determinant()));
      scaled_.push_back(scaled);
      core_.push_back(inner.solve(L));
    }
  }
  double log_determinant() const { return log_determinant_; }

  MatrixXd solve(const MatrixXd& m) const {
    MatrixXd result = d_.cwiseInverse().asDiagonal() * m;
    for (std::size_t b = 0; b < design_->blocks.size(); ++b) {
      const Block& block = design_->blocks[b];
      result.middleRows(block.first, block.size) -=
          scaled_[b] * (core_[b] * (scaled_[b].transpose() * m.middleRows(block.first, block.size)));
    }
    return result;
  }

  /// tr(V⁻¹ V_k), V_k the derivative of V by the component's variance.
  double trace(const Component& component) const {
    double sum = 0;
    for (std::size_t b = 0; b < design_->blocks.size(); ++b) {
      const Block& block = design_->blocks[b];
      if (component.term == Term::residual) {
        for (Index i = 0; i < block.size; ++i) {
          if (design_->rows[static_cast<std::size_t>(block.first + i)].kind != component.kind) continue;
          sum += 1 / d_[block.first + i] - (scaled_[b].row(i) * core_[b]).dot(scaled_[b].row(i));
        }
      } else {
        // Zᵀ V⁻¹ Z = A − A core A with A = Zᵀ D⁻¹ Z; Z of this term alone: the first column, or the others
        MatrixXd A(scaled_[b].cols(), scaled_[b].cols());
        A.col(0) = scaled_[b].colwise().sum().transpose();
        for (Index c = 1; c < A.cols(); ++c) A.col(c).setZero();
        for (Index i = 0; i < block.size; ++i) {
          A.col(1 + block.kind_column[static_cast<std::size_t>(i)]) += scaled_[b].row(i).transpose();
        }
        const MatrixXd inside = A - A.transpose() * core_[b] * A;
        sum += component.term == Term::cell ? inside(0, 0) : inside.diagonal().tail(A.cols() - 1).sum();
      }
    }
    return sum;
  }

 private:
  const Design* design_;
  VectorXd d_;
  std::vector<MatrixXd> scaled_;  ///< D⁻¹ Z by block
  std::vector<MatrixXd> core_;    ///< (I + L Zᵀ D⁻¹ Z)⁻¹ L by block
  double log_determinant_ = 0;
};

/// V_k m.
MatrixXd derivative_times(const Design& design, const Component& component, const MatrixXd& m) {
  MatrixXd result = MatrixXd::Zero(m.rows(), m.cols());
  for (const Block& block : design.blocks) {
    MatrixXd sums = MatrixXd::Zero(std::max(1, block.n_kinds), m.cols());
    const auto column = [&](Index i) {
      return component.term == Term::cell ? 0 : block.kind_column[static_cast<std::size_t>(i)];
    };
    for (Index i = 0; i < block.size; ++i) {
      const Index row = block.first + i;
      if (component.term != Term::residual) {
        sums.row(column(i)) += m.row(row);
      } else if (design.rows[static_cast<std::size_t>(row)].kind == component.kind) {
        result.row(row) = m.row(row);
      }
    }
    if (component.term == Term::residual) continue;
    for (Index i = 0; i < block.size; ++i) result.row(block.first + i) = sums.row(column(i));
  }
  return result;
}

/// The likelihood at given variances, with all that its derivatives need.
struct State {
  VectorXd v;
  Covariance inverse;
  MatrixXd W;        ///< V⁻¹ X
  MatrixXd C;        ///< (Xᵀ V⁻¹ X)⁻¹
  VectorXd mean, r;  ///< r = V⁻¹ (y − X mean) = P y
  double log_likelihood = 0;
};

State state_at(const Design& design, const VectorXd& v) {
  State s{.v = v, .inverse = Covariance(design, v), .W = {}, .C = {}, .mean = {}, .r = {}};
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
                             n * std::log(2 * 3.14159265358979323846));
  return s;
}

struct Derivatives {
  VectorXd gradient;
  MatrixXd information;               // average of observed and expected
  std::vector<MatrixXd> mean_slopes;  // of C by each variance
};
Derivatives derivatives_at(const Design& design, const State& s) {
  const Index n = static_cast<Index>(design.components.size());
  Derivatives d{.gradient = VectorXd(n), .information = MatrixXd(n, n), .mean_slopes = {}};
  MatrixXd Vr(design.y.size(), n);
  for (Index k = 0; k < n; ++k) {
    const Component& component = design.components[static_cast<std::size_t>(k)];
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
  for (Index k = 0; k < v.size(); ++k) {
    if (v[k] > lower[k] || gradient[k] > 0) list.push_back(k);
  }
  return list;
}

MatrixXd part(const MatrixXd& m, const std::vector<Index>& which) { return m(which, which); }

VectorXd newton_step(const Derivatives& d, const std::vector<Index>& free) {
  VectorXd step = VectorXd::Zero(d.gradient.size());
  if (free.empty()) return step;
  const VectorXd g = d.gradient(free);
  const VectorXd of_free = part(d.information, free).completeOrthogonalDecomposition().solve(g);
  step(free) = of_free;
  return step;
}

/// A step that never lowers the likelihood (Dempster, Laird & Rubin 1977), for where Newton's overshoots.
VectorXd em_step(const Design& design, const State& s, const Derivatives& d) {
  VectorXd step(d.gradient.size());
  for (Index k = 0; k < step.size(); ++k) {
    const Component& c = design.components[static_cast<std::size_t>(k)];
    double n_levels = 0;
    for (const Block& b : design.blocks) {
      n_levels += c.term == Term::cell ? 1 : c.term == Term::cell_kind ? b.n_kinds : static_cast<double>(b.size);
    }
    step[k] = 2 * s.v[k] * s.v[k] * d.gradient[k] / n_levels;
  }
  return step;
}

}  // namespace

MixedFit fit_mixed_model(std::vector<Observation> observations) {
  const Design design = design_of(std::move(observations));
  const Index n = static_cast<Index>(design.components.size());
  VectorXd lower = VectorXd::Zero(n), start(n);
  const double variance = (design.y.array() - design.y.mean()).square().mean();
  for (Index k = 0; k < n; ++k) {
    const bool is_residual = design.components[static_cast<std::size_t>(k)].term == Term::residual;
    if (is_residual) lower[k] = design.smallest_residual;
    start[k] = (is_residual ? 0.5 : 0.2) * variance;
  }
  State s = state_at(design, start);
  MixedFit fit;
  constexpr int kMaxSteps = 200;       // some ten do but where a variance creeps towards zero
  constexpr double kTolerance = 1e-9;  // of the log-likelihood: nothing that anyone reads changes
  Derivatives d = derivatives_at(design, s);
  for (int i = 0; i < kMaxSteps && !fit.converged; ++i) {
    const VectorXd newton = newton_step(d, free_ones(s.v, lower, d.gradient));
    double gain = -1;
    for (double share = 1; share > 1e-3 && gain < 0; share /= 2) {
      State next = state_at(design, (s.v + share * newton).cwiseMax(lower));
      gain = next.log_likelihood - s.log_likelihood;
      if (gain >= 0) s = std::move(next);
    }
    if (gain < 0) {
      State next = state_at(design, (s.v + em_step(design, s, d)).cwiseMax(lower));
      gain = std::max(0.0, next.log_likelihood - s.log_likelihood);
      s = std::move(next);
    }
    d = derivatives_at(design, s);
    // half of what a full Newton step promises
    const double promise = 0.5 * newton_step(d, free_ones(s.v, lower, d.gradient)).dot(d.gradient);
    fit.converged = gain < kTolerance && promise < kTolerance;
  }
  fit.mean = s.mean;
  fit.covariance = s.C;
  fit.log_likelihood = s.log_likelihood;
  fit.n_cells = static_cast<int>(design.blocks.size());
  fit.n_observations = static_cast<int>(design.rows.size());
  std::vector<double> residual;
  std::vector<Index> estimated;
  for (Index k = 0; k < n; ++k) {
    const Term term = design.components[static_cast<std::size_t>(k)].term;
    if (term == Term::cell) fit.cell_variance = s.v[k];
    if (term == Term::cell_kind) fit.cell_kind_variance = s.v[k];
    if (term == Term::residual) residual.push_back(s.v[k]);
    if (s.v[k] <= lower[k]) continue;
    estimated.push_back(k);
    fit.covariance_slopes.push_back(d.mean_slopes[static_cast<std::size_t>(k)]);
  }
  fit.residual_variance = Eigen::Map<VectorXd>(residual.data(), static_cast<Index>(residual.size()));
  fit.variance_covariance = part(d.information, estimated).completeOrthogonalDecomposition().pseudoInverse();
  return fit;
}

}  // namespace mbtfm::statistics
