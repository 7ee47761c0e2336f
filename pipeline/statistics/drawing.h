/// What the figures of a study share.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {

/// In turn, where there are more conditions than colours.
std::string condition_colour(int condition);
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
/// Each figure of the sheets by condition.
Figure sheet_figure(const Study& study, const Analysis& analysis);
/// The same of the cells in space.
Figure space_figure(const Study& study, const Analysis& analysis);
std::vector<Figure> adhesion_figures_of(const Analysis& analysis);

}  // namespace mbtfm::statistics
