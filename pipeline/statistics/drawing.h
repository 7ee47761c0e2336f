/// What the figures of a study share.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {

/// Not those of the fibres' types. In turn, if there are more conditions than colours.
std::string condition_colour(int condition);
/// Of a kind under a condition: the condition's, or if there is one only, the kind's.
std::string colour_of(const Sample& sample, int condition, int kind);
/// "n = 56, 48, 56 fibres of 8, 8, 8 cells", in the order of the kinds.
std::string counts_by_kind(const Sample& sample);
/// With their numbers; none for one condition.
void add_condition_keys(charts::Chart& chart, const Sample& sample);
std::size_t n_keys_of(const Sample& sample);

/// Kinds side by side with their conditions in them, or the conditions of one kind.
struct ColumnPlaces {
  const Sample& sample;
  std::optional<int> kind = {};  ///< none: all
  charts::Axis axis() const;
  double place(int condition, int kind) const;
  double width() const;
};

/// Observations as small dots, cells as large ones, the mean of the mixed model with its 95 % interval.
/// Source: Lord et al., J. Cell Biol. 219 (2020) e202001064, "SuperPlots".
/// @param kind  none: all of the sample
charts::Chart super_plot(const Study& study, const Measure& measure, std::optional<int> kind, const std::string& title);
/// @throws InternalError where it is not there
int index_of(const std::vector<std::string>& list, const std::string& name);

/// Of the i-th of many points: from −1/2 to 1/2, which they fill evenly (golden ratio).
double place_in_column(int i);

/// The end of a y axis that leaves `largest` below the lines of the key: each takes 18 of the frame's 236 pixels.
double end_below_keys(double largest, std::size_t n_keys);

struct Histogram {
  std::string label;  ///< of the key; empty: none
  std::string colour;
  std::vector<double> values = {};
  bool is_dashed = false;
};
/// As the rule of Sturges gives the largest sample, ten at least.
int n_bins_of(const std::vector<Histogram>& histograms);
/// Shares of the values in equal bins (of the logarithm, on a logarithmic axis), as steps; as many bins for all.
charts::Chart histogram_chart(const std::string& title, const std::string& x_label, const std::string& y_label,
                              const std::vector<Histogram>& histograms, double low, double high, charts::Scale scale);

/// The primary comparison as a SuperPlot, and its differences; none of one condition.
std::optional<Figure> primary_figure(const Study& study, const Analysis& analysis, const StudyParameters& parameters);
/// Each measure of the sheets, or of the cells in space, by condition.
Figure figure_of_kind(const Study& study, const Analysis& analysis, CellKind kind);
std::vector<Figure> adhesion_figures_of(const Analysis& analysis);

}  // namespace mbtfm::statistics
