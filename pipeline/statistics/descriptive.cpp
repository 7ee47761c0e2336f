#include "pipeline/statistics/descriptive.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/distributions.h"

namespace mbtfm::statistics {
namespace {

void need_values(const std::vector<double>& values) {
  if (values.empty()) throw InvalidData("a sample", "at least one value", "none");
}

double sum_of(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

}  // namespace

Description describe(std::vector<double> values) {
  need_values(values);
  std::ranges::sort(values);
  Description d{};
  d.n = static_cast<int>(values.size());
  d.mean = sum_of(values) / d.n;
  d.median = (values[(values.size() - 1) / 2] + values[values.size() / 2]) / 2;
  double squares = 0;
  for (const double v : values) squares += (v - d.mean) * (v - d.mean);
  if (d.n > 1) d.standard_deviation = std::sqrt(squares / (d.n - 1));
  return d;
}

Interval wilson_interval(double share, double n) {
  const double z2 = kNormal95 * kNormal95;
  const double centre = (share + z2 / (2 * n)) / (1 + z2 / n);
  const double half = kNormal95 / (1 + z2 / n) * std::sqrt(share * (1 - share) / n + z2 / (4 * n * n));
  return {std::max(0.0, centre - half), std::min(1.0, centre + half)};
}

Share share_over_cells(const std::vector<CellCount>& cells) {
  double n = 0, with = 0, n_cells = 0;
  for (const CellCount& c : cells) {
    n += c.n;
    with += c.n_with;
    n_cells += c.n > 0 ? 1 : 0;
  }
  if (n == 0) throw InvalidData("a sample", "at least one value", "none");
  Share share{.value = with / n, .n_effective = n_cells};
  if (with > 0 && with < n && n_cells > 1) {
    double squares = 0;  // of the residuals of the ratio, by cell
    for (const CellCount& c : cells) squares += std::pow(c.n_with - share.value * c.n, 2);
    const double variance = n_cells / (n_cells - 1) * squares / (n * n);
    const double t = numerics::student_quantile(n_cells - 1, 0.975);
    const double as_many = share.value * (1 - share.value) / std::max(variance, 1e-300);
    share.n_effective = std::min(n, as_many * std::pow(kNormal95 / t, 2));
  }
  share.interval = wilson_interval(share.value, share.n_effective);
  return share;
}

LineThroughOrigin line_through_origin(const std::vector<double>& x, const std::vector<double>& y) {
  LineThroughOrigin line{.n = static_cast<int>(x.size()), .slope = 0};
  const double xx = std::inner_product(x.begin(), x.end(), x.begin(), 0.0);
  if (!(xx > 0)) throw InvalidData("a line through the origin", "a point beside it", "none");
  line.slope = std::inner_product(x.begin(), x.end(), y.begin(), 0.0) / xx;
  if (line.n < 2) return line;
  double squares = 0, sxx = 0, syy = 0, sxy = 0;
  const double mean_x = sum_of(x) / line.n, mean_y = sum_of(y) / line.n;
  for (std::size_t i = 0; i < x.size(); ++i) {
    squares += std::pow(y[i] - line.slope * x[i], 2);
    sxx += (x[i] - mean_x) * (x[i] - mean_x);
    syy += (y[i] - mean_y) * (y[i] - mean_y);
    sxy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  line.slope_error = std::sqrt(squares / (line.n - 1) / xx);
  if (sxx > 0 && syy > 0) line.correlation = sxy / std::sqrt(sxx * syy);
  return line;
}

Deconvolved deconvolved_moments(const std::vector<double>& values, const std::vector<double>& error_variances) {
  const std::optional<double> deviation = describe(values).standard_deviation;
  if (!deviation) throw InvalidData("a sample", "at least two values", "one");
  const double variance = *deviation * *deviation;
  const double error = sum_of(error_variances) / static_cast<double>(values.size());
  const double left = std::max(0.0, variance - error);
  return {.standard_deviation = std::sqrt(left), .reliability = variance > 0 ? left / variance : 0};
}

double deconvolved_fraction_above(const std::vector<double>& values, const std::vector<double>& error_variances,
                                  double threshold) {
  need_values(values);
  // The grid has the threshold half way between two of its points; finer than 80 of them changes nothing: errors blur
  // it.
  const double largest = *std::ranges::max_element(values);
  constexpr int kPoints = 80, kSteps = 100;  // the mass above a threshold then changes by less than its sampling error
  const double widest = std::max(largest, threshold);
  const int n_below = std::max(1, static_cast<int>(std::lround(kPoints * threshold / widest)));
  const double step = threshold / (n_below - 0.5);
  // a threshold far below all values must not make the grid above it endless
  const double step_above = std::max(step, (widest - threshold) / kPoints);
  const int n_above = static_cast<int>(std::ceil((widest - threshold) / step_above + 0.5));
  const int n_points = n_below + n_above;
  const auto point = [&](int k) { return k < n_below ? k * step : threshold + (k - n_below + 0.5) * step_above; };
  std::vector<std::vector<double>> kernel;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double grid = values[i] > threshold ? step_above : step;
    const double sigma = std::max(std::sqrt(error_variances[i]), grid / 2);  // no finer than the grid
    std::vector<double> row;
    for (int k = 0; k < n_points; ++k) {
      const double z = (values[i] - point(k)) / sigma;
      row.push_back((values[i] > 0 ? std::exp(-z * z / 2) / sigma : numerics::normal_below(z) + 1e-300) + 1e-300);
    }
    kernel.push_back(std::move(row));
  }
  std::vector<double> mass(static_cast<std::size_t>(n_points), 1.0 / n_points);
  for (int i = 0; i < kSteps; ++i) {
    std::vector<double> next(mass.size(), 0);
    for (const auto& row : kernel) {
      const double total = std::inner_product(row.begin(), row.end(), mass.begin(), 0.0);
      for (std::size_t k = 0; k < mass.size(); ++k) next[k] += row[k] * mass[k] / total;
    }
    for (std::size_t k = 0; k < mass.size(); ++k) mass[k] = next[k] / static_cast<double>(values.size());
  }
  constexpr double kNothing = 1e-9;  // what EM leaves where it would end at zero
  const double above = std::accumulate(mass.begin() + n_below, mass.end(), 0.0);
  return above > kNothing ? std::min(above, 1.0) : 0;
}

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
