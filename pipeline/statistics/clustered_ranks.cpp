#include <Eigen/Dense>
#include <algorithm>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/distributions.h"
#include "pipeline/statistics/rank_tests.h"

namespace mbtfm::statistics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A distribution by its sorted values, each of weight 1 / n: (F(x) + F(x−)) / 2.
class Distribution {
 public:
  void add(double value, double weight) { sorted_.push_back({value, weight}); }
  void finish() {
    std::ranges::sort(sorted_);
    double sum = 0;
    for (auto& [value, weight] : sorted_) weight = sum += weight;  // from here on cumulated
  }
  double at(double x) const {
    const auto value_of = [](const std::pair<double, double>& p) { return p.first; };
    const auto before = std::ranges::lower_bound(sorted_, x, {}, value_of);
    const auto behind = std::ranges::upper_bound(sorted_, x, {}, value_of);
    return (cumulated(before) + cumulated(behind)) / 2;
  }

 private:
  double cumulated(std::vector<std::pair<double, double>>::const_iterator end) const {
    return end == sorted_.begin() ? 0 : std::prev(end)->second;
  }
  std::vector<std::pair<double, double>> sorted_;
};

struct CellRanks {
  MatrixXd sum, expected, deviation;  ///< cells × groups
};

CellRanks ranks_by_cell(const std::vector<ClusteredValue>& values) {
  std::map<int, std::vector<const ClusteredValue*>> cells;
  int n_groups = 0;
  for (const ClusteredValue& v : values) {
    cells[v.cell].push_back(&v);
    n_groups = std::max(n_groups, v.group + 1);
  }
  const Index M = static_cast<Index>(cells.size());
  const double m = static_cast<double>(M);
  Distribution pooled;
  MatrixXd share = MatrixXd::Zero(M, n_groups);  // of each cell's values
  Index i = 0;
  for (const auto& [id, own] : cells) {
    for (const ClusteredValue* v : own) {
      share(i, v->group) += 1.0 / static_cast<double>(own.size());
      pooled.add(v->value, 1.0 / static_cast<double>(own.size()));
    }
    ++i;
  }
  pooled.finish();
  const VectorXd all = share.colwise().sum();
  CellRanks ranks{.sum = MatrixXd::Zero(M, n_groups), .expected = share / 2, .deviation = MatrixXd::Zero(M, n_groups)};
  i = 0;
  for (const auto& [id, own] : cells) {
    const double n = static_cast<double>(own.size());
    Distribution of_cell;
    for (const ClusteredValue* v : own) of_cell.add(v->value, 1 / n);
    of_cell.finish();
    const VectorXd others = all - share.row(i).transpose();
    for (const ClusteredValue* v : own) {
      const double everywhere = pooled.at(v->value);
      ranks.sum(i, v->group) += (1 + everywhere - of_cell.at(v->value)) / (n * (m + 1));
      // eq. 5 there: what the cell adds to the sum of all, its own ranks and those that it gives to others
      VectorXd weight = -others;
      weight[v->group] += m - 1;
      ranks.deviation.row(i) += everywhere / m / (n * (m + 1)) * weight.transpose();
    }
    ranks.deviation.row(i) -= m / (2 * (m + 1)) * (share.row(i) - all.transpose() / m);
    ++i;
  }
  return ranks;
}

void check_groups(const std::vector<ClusteredValue>& values) {
  std::map<int, int> n_of;
  int n_groups = 0;
  for (const ClusteredValue& v : values) {
    ++n_of[v.group];
    n_groups = std::max(n_groups, v.group + 1);
  }
  if (n_groups < 2) throw InvalidData("the groups", "at least two", std::to_string(n_groups));
  if (static_cast<int>(n_of.size()) < n_groups) throw InvalidData("a group", "at least one value", "none");
}

}  // namespace

ClusteredRanks clustered_ranks(const std::vector<ClusteredValue>& values) {
  check_groups(values);
  const CellRanks ranks = ranks_by_cell(values);
  const VectorXd sum = ranks.sum.colwise().sum(), expected = ranks.expected.colwise().sum();
  return {{sum.begin(), sum.end()}, {expected.begin(), expected.end()}};
}

TestResult clustered_rank_test(const std::vector<ClusteredValue>& values) {
  check_groups(values);
  const CellRanks ranks = ranks_by_cell(values);
  const Index q = ranks.sum.cols() - 1;  // the groups' sums add up to a constant: leave out the last
  const double n_cells = static_cast<double>(ranks.sum.rows()), degrees = n_cells - static_cast<double>(q);
  if (degrees < 1) throw InvalidData("the cells", "more than there are groups", std::to_string(ranks.sum.rows()));
  const MatrixXd centred = ranks.deviation.rowwise() - ranks.deviation.colwise().mean();
  const VectorXd distance = (ranks.sum - ranks.expected).colwise().sum().head(q).transpose();
  const MatrixXd spread = (n_cells / (n_cells - 1) * centred.transpose() * centred).topLeftCorner(q, q);
  const Eigen::LDLT<MatrixXd> ldlt(spread);
  if (!(ldlt.vectorD().minCoeff() > 1e-12)) throw InvalidData("the groups", "values that scatter", "none that do");
  const double chi_squared = distance.dot(ldlt.solve(distance));
  const double f = chi_squared * degrees / (static_cast<double>(q) * (n_cells - 1));
  return {.statistic = f, .p_value = numerics::fisher_above(static_cast<double>(q), degrees, f)};
}

}  // namespace mbtfm::statistics
