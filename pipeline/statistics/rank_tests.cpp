#include "pipeline/statistics/rank_tests.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/distributions.h"

namespace mbtfm::statistics {
namespace {

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

}  // namespace mbtfm::statistics
