/// Intervals that take the cell for the unit: whole cells are resampled, with all that was measured in them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "pipeline/statistics/descriptive.h"

namespace mbtfm::statistics {

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

}  // namespace mbtfm::statistics
