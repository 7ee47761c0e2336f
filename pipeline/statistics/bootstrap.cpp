#include "pipeline/statistics/bootstrap.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/distributions.h"

namespace mbtfm::statistics {

std::vector<CellWeights> draw_cells(const std::vector<int>& stratum_of_cell, int n_draws, std::uint64_t seed) {
  std::map<int, std::vector<std::size_t>> strata;
  for (std::size_t c = 0; c < stratum_of_cell.size(); ++c) strata[stratum_of_cell[c]].push_back(c);
  std::mt19937_64 random(seed);
  std::vector<CellWeights> draws(static_cast<std::size_t>(n_draws), CellWeights(stratum_of_cell.size(), 0));
  for (CellWeights& weights : draws) {
    for (const auto& [stratum, cells] : strata) {
      // a remainder instead of std::uniform_int_distribution, which differs between libraries; its bias is 1e-17
      for (std::size_t i = 0; i < cells.size(); ++i) weights[cells[random() % cells.size()]] += 1;
    }
  }
  return draws;
}

std::optional<Interval> bootstrap_interval(std::vector<std::optional<double>> values, int n_cells) {
  if (n_cells < 2) return std::nullopt;
  std::vector<double> defined;
  for (const auto& v : values)
    if (v) defined.push_back(*v);
  if (static_cast<double>(defined.size()) < 0.95 * static_cast<double>(values.size())) return std::nullopt;
  std::ranges::sort(defined);
  const double t = numerics::student_quantile(n_cells - 1, 0.025);
  const double share = numerics::normal_below(t * std::sqrt(n_cells / (n_cells - 1.0)));
  const double last = static_cast<double>(defined.size()) - 1;
  const auto at = [&](double p) {
    const double place = std::clamp(p, 0.0, 1.0) * last;
    const auto below = static_cast<std::size_t>(place);
    const double next = defined[std::min(below + 1, defined.size() - 1)];
    return defined[below] + (place - static_cast<double>(below)) * (next - defined[below]);
  };
  return Interval{at(share), at(1 - share)};
}

std::optional<Interval> ratio_interval(const std::map<int, std::pair<double, double>>& by_cell,
                                       const std::vector<CellWeights>& draws) {
  std::vector<std::optional<double>> ratios;
  for (const CellWeights& w : draws) {
    double a = 0, b = 0;
    for (const auto& [cell, pair] : by_cell) {
      a += w[cell] * pair.first;
      b += w[cell] * pair.second;
    }
    ratios.push_back(b > 0 ? std::optional<double>(a / b) : std::nullopt);
  }
  return bootstrap_interval(std::move(ratios), static_cast<int>(by_cell.size()));
}

}  // namespace mbtfm::statistics
