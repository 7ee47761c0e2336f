#include "pipeline/statistics/rank_tests.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/distributions.h"

namespace mbtfm::statistics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Ranks {
  std::vector<double> rank;  ///< by value, from 1; equal values share their mean rank
  double ties = 0;           ///< sum over sets of equal values of size³ − size
};

Ranks ranks_of(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  Ranks ranks;
  ranks.rank.resize(values.size());
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first + 1;
    while (end < order.size() && values[order[end]] == values[order[first]]) ++end;
    const double size = static_cast<double>(end - first);
    for (std::size_t i = first; i < end; ++i) ranks.rank[order[i]] = static_cast<double>(first + 1 + end) / 2;
    ranks.ties += size * size * size - size;
    first = end;
  }
  return ranks;
}

/// All groups in one row, with their ranks.
Ranks joint_ranks(const std::vector<std::vector<double>>& groups) {
  std::vector<double> all;
  for (const auto& group : groups) {
    if (group.empty()) throw InvalidData("a group", "at least one value", "none");
    all.insert(all.end(), group.begin(), group.end());
  }
  Ranks ranks = ranks_of(all);
  const double n = static_cast<double>(all.size());
  if (ranks.ties == n * n * n - n) throw InvalidData("the groups", "values that differ", "all equal");
  return ranks;
}

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
  std::set<int> groups;
  for (const ClusteredValue& v : values) {
    cells[v.cell].push_back(&v);
    groups.insert(v.group);
  }
  const int n_groups = groups.empty() ? 0 : *groups.rbegin() + 1;
  if (n_groups < 2) throw InvalidData("the groups", "at least two", std::to_string(n_groups));
  if (std::ssize(groups) < n_groups) throw InvalidData("a group", "at least one value", "none");
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

}  // namespace

TestResult kruskal_wallis(const std::vector<std::vector<double>>& groups) {
  if (groups.size() < 2) throw InvalidData("the groups", "at least two", std::to_string(groups.size()));
  const Ranks ranks = joint_ranks(groups);
  const double n = static_cast<double>(ranks.rank.size());
  double sum = 0;
  std::size_t at = 0;
  for (const auto& group : groups) {
    double rank_sum = 0;
    for (std::size_t i = 0; i < group.size(); ++i) rank_sum += ranks.rank[at++];
    sum += rank_sum * rank_sum / static_cast<double>(group.size());
  }
  const double tie_correction = 1 - ranks.ties / (n * n * n - n);
  const double h = (12 / (n * (n + 1)) * sum - 3 * (n + 1)) / tie_correction;
  // h is not negative but for rounding
  return {.statistic = h,
          .p_value = numerics::chi_squared_above(static_cast<double>(groups.size() - 1), std::max(h, 0.0))};
}

TestResult mann_whitney(const std::vector<double>& a, const std::vector<double>& b) {
  const Ranks ranks = joint_ranks({a, b});
  const double n_a = static_cast<double>(a.size()), n_b = static_cast<double>(b.size()), n = n_a + n_b;
  const double rank_sum =
      std::accumulate(ranks.rank.begin(), ranks.rank.begin() + static_cast<std::ptrdiff_t>(a.size()), 0.0);
  const double u = rank_sum - n_a * (n_a + 1) / 2;
  const double variance = n_a * n_b / 12 * ((n + 1) - ranks.ties / (n * (n - 1)));
  const double distance = std::max(0.0, std::abs(u - n_a * n_b / 2) - 0.5);  // U is a whole number: continuity
  const double p = 2 * numerics::normal_above(distance / std::sqrt(variance));
  return {.statistic = u, .p_value = std::min(1.0, p)};
}

std::vector<double> holm(const std::vector<double>& p_values) {
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return p_values[a] < p_values[b]; });
  std::vector<double> corrected(p_values.size());
  double largest = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    largest = std::max(largest, std::min(1.0, static_cast<double>(order.size() - i) * p_values[order[i]]));
    corrected[order[i]] = largest;
  }
  return corrected;
}

TestResult clustered_rank_test(const std::vector<ClusteredValue>& values) {
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
