/// Tests that compare groups by rank: no assumption on the distribution but that it is the same in all groups.
#pragma once

#include <vector>

namespace mbtfm::statistics {

struct Description {
  int n = 0;
  double mean = 0, median = 0;
  double standard_deviation = 0;  ///< with n − 1; 0 for n = 1
};
/// @throws InvalidData where there is no value
Description describe(std::vector<double> values);
/// Share of values above the threshold, 0 to 1.
double fraction_above(const std::vector<double>& values, double threshold);

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

/// Holm's correction for several tests: the same order as given.
/// Source: Holm, Scand. J. Stat. 6, 65 (1979).
std::vector<double> holm(const std::vector<double>& p_values);

}  // namespace mbtfm::statistics
