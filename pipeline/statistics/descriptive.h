/// Figures that describe a sample, what a line or a share says with its error, and intervals that take the cell for the
/// unit: whole cells are resampled, with all that was measured in them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace mbtfm::statistics {

struct Description {
  int n = 0;
  double mean = 0, median = 0;
  std::optional<double> standard_deviation = {};  ///< with n − 1; none of one value
};
/// @throws InvalidData where there is no value
Description describe(std::vector<double> values);

/// Of the normal distribution: 95 % lie this many standard errors around the mean.
inline constexpr double kNormal95 = 1.959963984540054;

struct Interval {
  double low = 0, high = 0;
};

/// Wilson's 95 % interval of a share of n independent observations; n need not be whole.
/// Source: Wilson, J. Am. Stat. Assoc. 22, 209 (1927).
Interval wilson_interval(double share, double n);

/// A share of all observations of all cells, with Wilson's interval at the number of independent observations that
/// would scatter as much as the cells do. Source: Korn & Graubard, Survey Methodology 24, 193 (1998). If none or all
/// have the property the cells do not show how they scatter: each then counts once.
struct Share {
  double value = 0;
  Interval interval = {};  ///< 95 %
  double n_effective = 0;
};
struct CellCount {
  int n = 0, n_with = 0;
};
/// @throws InvalidData where no cell has an observation
Share share_over_cells(const std::vector<CellCount>& cells);

/// y = slope x, by least squares; its error supposes one scatter of all points (R: lm(y ~ 0 + x)).
struct LineThroughOrigin {
  int n = 0;
  double slope = 0;
  std::optional<double> slope_error = {};  ///< standard error; none of one point
  std::optional<double> correlation = {};  ///< Pearson's; none where x or y does not vary
};
/// @throws InvalidData where no x differs from zero
LineThroughOrigin line_through_origin(const std::vector<double>& x, const std::vector<double>& y);

/// What the values would be without their measurement errors, which are independent of them; two values at least.
struct Deconvolved {
  double standard_deviation = 0;  ///< √(variance − mean error variance), 0 where the errors explain all scatter
  double reliability = 0;         ///< share of the variance that is not error, 0 to 1
};
/// @throws InvalidData for fewer than two values
Deconvolved deconvolved_moments(const std::vector<double>& values, const std::vector<double>& error_variances);

/// Share above a threshold without the blur of the errors: the distribution that makes the values most likely, given
/// normal errors of known size, found by EM on a grid; a value at zero or below says only that the sum with its error
/// was not positive. Source: Laird, J. Am. Stat. Assoc. 73, 805 (1978); Koenker & Mizera, ibid. 109, 674 (2014).
/// @param values  not negative
double deconvolved_fraction_above(const std::vector<double>& values, const std::vector<double>& error_variances,
                                  double threshold);

/// How often each cell is drawn.
using CellWeights = std::vector<double>;

/// Draws of as many cells as there are, with replacement, within each stratum: conditions keep their numbers of cells.
/// The same for the same seed on any machine.
std::vector<CellWeights> draw_cells(const std::vector<int>& stratum_of_cell, int n_draws, std::uint64_t seed);

/// 95 % interval of a statistic from its values at the draws, at the percentiles that make up for few cells:
/// Phi(t √(n/(n−1))) with t of n − 1 degrees instead of 2.5 %. A resample of the means of fibres as well would count
/// their scatter twice, which the cells' means carry already.
/// Source: Hesterberg, Am. Stat. 69, 371 (2015), "expanded percentile"; Davison & Hinkley, Bootstrap Methods
/// (1997), 3.8.
/// @param n_cells  independent cells behind the statistic, 2 at least
/// @returns none where the statistic is undefined in more than one of twenty draws
std::optional<Interval> bootstrap_interval(std::vector<std::optional<double>> values, int n_cells);
/// Interval of Σ a / Σ b over cells: of a mean (b the numbers), of a slope through the origin (x y and x²).
std::optional<Interval> ratio_interval(const std::map<int, std::pair<double, double>>& by_cell,
                                       const std::vector<CellWeights>& draws);

/// Values by cell: their mean, with the interval that takes the cell for the unit.
class CellMean {
 public:
  void add(int cell, double value) {
    sum_ += value;
    ++n_;
    by_cell_[cell].first += value;
    by_cell_[cell].second += 1;
  }
  int n() const { return n_; }
  int n_cells() const { return static_cast<int>(by_cell_.size()); }
  double mean() const { return sum_ / n_; }
  std::optional<Interval> interval(const std::vector<CellWeights>& draws) const {
    return ratio_interval(by_cell_, draws);
  }

 private:
  double sum_ = 0;
  int n_ = 0;
  std::map<int, std::pair<double, double>> by_cell_;  ///< sum, number
};

}  // namespace mbtfm::statistics
