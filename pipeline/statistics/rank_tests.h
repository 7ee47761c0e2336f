/// Tests that compare groups by rank: no assumption on the distribution but that it is the same in all groups.
#pragma once

#include <vector>

namespace mbtfm::statistics {

struct TestResult {
  double statistic = 0;
  double p_value = 1;
};

/// Kruskal–Wallis H, corrected for ties, with the chi-squared approximation (n − 1 groups degrees of freedom).
/// Source: Kruskal & Wallis, J. Am. Stat. Assoc. 47, 583 (1952); from about 5 values a group on.
/// @throws InvalidData for fewer than two groups, an empty one, or all values equal
TestResult kruskal_wallis(const std::vector<std::vector<double>>& groups);

/// Mann–Whitney U of `a` (number of pairs in which a's value is larger, ties count half), two-sided, by the normal
/// approximation with corrections for ties and continuity.
/// Source: Mann & Whitney, Ann. Math. Stat. 18, 50 (1947); from about 8 values a group on.
/// @throws InvalidData where a group is empty or all values are equal
TestResult mann_whitney(const std::vector<double>& a, const std::vector<double>& b);

/// A value of a group, measured in a cell; both from 0.
struct ClusteredValue {
  double value = 0;
  int group = 0;
  int cell = 0;
};
/// Do the groups differ, with the cell for the unit: the rank-sum test of one value drawn from each cell, averaged over
/// all ways to draw. Cells may hold values of one group or of several; each counts once, however many values it has.
/// The sum over all pairs of groups is a chi-squared with n groups − 1 degrees of freedom; with few cells F with as
/// many and n cells − n groups + 1 degrees (as Hotelling's T² of the cells' contributions), which is what is used.
/// `statistic` is that F.
/// Source: Datta & Satten, J. Am. Stat. Assoc. 100, 908 (2005), with each cell weighing the same in the pooled ranks.
/// @throws InvalidData for fewer than two groups, an empty one, too few cells, or groups without any scatter
TestResult clustered_rank_test(const std::vector<ClusteredValue>& values);

/// Holm's correction for several tests: the same order as given.
/// Source: Holm, Scand. J. Stat. 6, 65 (1979).
std::vector<double> holm(const std::vector<double>& p_values);

}  // namespace mbtfm::statistics
