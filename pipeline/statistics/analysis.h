/// All that is said of a study: computed once, for the tables, the figures and the report.
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

// What goes with what: forces of cells with their size, force of adhesions with their area, directions.

/// A force of the cells, or a size, against a measure of their size, with a line through the origin (thesis figs. 3.11,
/// 3.12, A.1, A.2).
struct Correlation {
  std::string force, size;  ///< columns of cells.csv; force may be a size, or fttc_force_nN of fttc.json
  const char *force_label = "", *size_label = "", *size_unit = "";  ///< for people; unit: what one more of is counted
  std::string condition;
  std::vector<double> x = {}, y = {};
  std::vector<int> cells = {};                  ///< indices into Study::cells
  std::optional<LineThroughOrigin> line = {};   ///< none below kFewestForALine cells
  std::optional<Interval> slope_interval = {};  ///< 95 %, by the bootstrap of cells; none without a line
};
/// Below five points a slope and a correlation say next to nothing: the points alone are shown.
inline constexpr std::size_t kFewestForALine = 5;
std::vector<Correlation> correlate_forces(const Study& study, const std::vector<CellWeights>& draws);

/// Mean force of the adhesions whose area lies between two values (thesis fig. 3.13).
struct AreaBin {
  std::string condition;
  bool is_connected = false;
  double low_um2 = 0, high_um2 = 0;
  int n_cells = 0, n_adhesions = 0;
  double mean_area_um2 = 0, mean_force_nN = 0;
  std::optional<Interval> interval_nN = {};  ///< 95 % of the mean force, by the bootstrap of cells
};
/// Bins of as many adhesions each, all conditions together; none of no adhesions.
std::vector<AreaBin> bin_by_area(const Study& study, const std::vector<CellWeights>& draws);

/// Angles of one relation under one condition.
struct DirectionSummary {
  Relation relation = Relation::adhesion_fibre;
  std::string condition;
  int n_cells = 0, n = 0;
  std::vector<double> angles_deg = {};
  double mean_angle_deg = 0, mean_cosine = 0;
  std::optional<Interval> angle_interval_deg = {}, cosine_interval = {};  ///< 95 %, by the bootstrap of cells
};
std::vector<DirectionSummary> summarise_directions(const Study& study, const std::vector<CellWeights>& draws);

// The one comparison that a study was made for: each condition against the reference, by one test that was chosen
// before anybody looked.

/// A condition against the reference.
struct PrimaryDifference {
  std::string condition;
  Contrast difference;   ///< of the means, condition − reference, in the measure's unit
  double p_holm = 1;     ///< corrected for all conditions that are compared with the reference
  int cells = 0;         ///< of the condition
  int cells_before = 0;  ///< of the reference
  int replicates = 0;    ///< that have both; 0: the test goes by cells
};

struct Primary {
  std::string measure;  ///< "tension of ventral fibres", "total force of cells"
  std::string unit;
  std::string cells = "cells";  ///< what they are called: "sheets"
  std::string reference;
  std::string test;  ///< in words, with its source
  std::vector<PrimaryDifference> differences = {};
  /// Mean of the reference: of the model, or of the replicates' means.
  double reference_mean = 0;
  std::string obstacle = {};  ///< why nothing is compared; empty: something is
};

/// "p = 0.012"
std::string p_text(double p);
/// "tension of ventral fibres, drug minus control: −1.9 nN (−31 %) [95 % CI −3.0 to −0.8 nN], …"
std::string sentence_of(const Primary& primary, const PrimaryDifference& difference);

/// Without replicates the test is that of the mixed model (random effects of the cell, known errors). With replicates
/// the cells of one day are no more independent than the fibres of one cell: the means of the replicates are compared,
/// in pairs (Student's t of their differences). Source: Lord, Velle, Mullins, Fritz-Laylin, J. Cell Biol. 219 (2020)
/// e202001064.
/// @param name  of what is compared  @param sample  that has it, with its model and its comparisons
Primary primary_of(const Study& study, const std::string& name, const Sample& sample, int kind,
                   const std::optional<SampleModel>& model, const std::vector<Comparison>& comparisons);

/// A sample with what was found of it.
struct Measure {
  Sample sample;
  std::optional<SampleModel> model;
  std::string obstacle = {};  ///< why there is no model; empty: there is one
  std::vector<Summary> summaries = {};
  std::vector<Comparison> comparisons = {};
};

struct Analysis {
  bool has_fibres = true;  ///< some cells have them: else nothing is said of fibres and adhesions on flat gels
  Primary primary;
  std::vector<Measure> measures;  ///< in the order of the table of measures (samples.cpp)
  std::vector<Summary> tensions_by_cell;
  std::vector<ShareAbove> shares;
  std::vector<Correlation> correlations;
  std::vector<AreaBin> area_bins;
  std::vector<DirectionSummary> directions;
  std::vector<std::string> warnings;  ///< sentences on what the numbers cannot carry

  /// Null if no cell has one. @param column  of its sample
  const Measure* find(const std::string& column) const;
  /// The same, or one without values.
  const Measure& of(const std::string& column) const;
  const Measure& tensions() const { return of("tension_nN"); }
  std::vector<const Measure*> of_cells(CellKind kind) const;
};

/// What the primary comparison compares; none: no cell of the study has it.
struct PrimaryChoice {
  const Measure* measure = nullptr;
  int kind = 0;      ///< of the measure's sample
  std::string name;  ///< "tension of ventral fibres"
};
PrimaryChoice primary_choice(const Study& study, const Analysis& analysis, const StudyParameters& parameters);

Analysis analyse(const Study& study, const StudyParameters& parameters);

/// "control: ", or nothing where the study has one condition.
std::string prefix_of(const std::string& condition);
/// "ventral", "transverse arc", "connected": a kind as people say it.
std::string kind_for_people(const std::string& kind);

}  // namespace mbtfm::statistics
