/// Tests between kinds (fibre types; connected adhesions or not) and between conditions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/statistics/summaries.h"

namespace mbtfm::statistics {

/// What is counted as one observation. The fibres of a cell are not independent of each other: tests by observation
/// overstate the evidence; those of one median a cell, and those with the cell for the cluster, do not.
enum class Unit { observation, cell_median, cell };
constexpr auto words(Unit) { return std::array{"observation", "cell median", "cell"}; }

enum class Question { between_kinds, between_conditions };
constexpr auto words(Question) { return std::array{"between kinds", "between conditions"}; }

enum class Test { kruskal_wallis, mann_whitney, clustered_rank_sum, mixed_model };
constexpr auto words(Test) { return std::array{"Kruskal-Wallis", "Mann-Whitney", "clustered rank sum", "mixed model"}; }

struct Comparison {
  std::string column;  ///< what is compared: Sample::column
  Question question = Question::between_kinds;
  std::string within;  ///< the condition, or the kind, that all groups share
  Test test = Test::mann_whitney;
  Unit unit = Unit::observation;
  std::string group_a, group_b;  ///< group_b empty: all groups together
  int n_a = 0, n_b = 0;          ///< observations
  int cells_a = 0, cells_b = 0;
  double statistic = 0;
  std::optional<double> degrees = {};  ///< of freedom, of the statistic's denominator
  double p_value = 1;
  std::optional<double> p_holm;  ///< corrected for all pairs of the same test and question
  double effect = 0;
  std::string effect_name = {};           ///< what the effect is: see docs/statistics.md
  std::optional<Interval> interval = {};  ///< 95 %, of the effect
};

/// All tests of a sample; left out where a group has fewer than two observations, or all are equal.
/// By observation and by the cells' medians: Kruskal–Wallis, then Mann–Whitney for each pair. With the cell for the
/// unit: clustered rank-sum tests and the mixed model, F of all groups, then t of each pair's difference of means.
std::vector<Comparison> compare(const Sample& sample, const std::optional<SampleModel>& model);

}  // namespace mbtfm::statistics
