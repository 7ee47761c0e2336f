/// What each kind carries under each condition, with intervals that take the cell for the unit.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/statistics/descriptive.h"
#include "pipeline/statistics/samples.h"

namespace mbtfm::statistics {

/// The draws of cells that all intervals of a study share, within its conditions.
std::vector<CellWeights> draw_cells(const Study& study, const StudyParameters& parameters);

struct Summary {
  std::string cell = {};  ///< empty: all of the condition
  std::string condition, kind;
  int n_cells = 0, n = 0;
  Description plain;                         ///< each observation counts the same
  std::optional<double> typical_error;       ///< root mean square of the standard errors; none where none is known
  std::optional<Deconvolved> without_error;  ///< the scatter that the measurement's errors leave; none of one value
  std::optional<Interval> mean_interval = {}, median_interval = {};  ///< by the bootstrap of cells; none of one cell
  std::optional<Contrast> model;  ///< mean of the mixed model; none of a group in one cell
};

/// The mixed model of a sample, by the groups that have observations.
struct SampleModel {
  MixedFit fit;
  std::vector<int> index;  ///< of a group in the fit, −1: it has no observation
};
struct ModelResult {
  std::optional<SampleModel> model;
  std::string obstacle = {};  ///< why there is none, for people: "there is a single cell"
};
ModelResult model_of(const Sample& sample);

/// A row for each condition and kind that was observed.
std::vector<Summary> summarise(const Sample& sample, const std::optional<SampleModel>& model,
                               const std::vector<CellWeights>& draws);
/// The same of each cell by itself, without intervals.
std::vector<Summary> summarise_by_cell(const Sample& sample, const Study& study);

/// The fibres whose tension is above a threshold.
struct ShareAbove {
  std::string condition, kind;
  double threshold_nN = 0;
  int n_cells = 0, n = 0;
  Share share;
  double without_error = 0;  ///< the blur of the measurement removed
};
std::vector<ShareAbove> shares_above(const Sample& tensions, const std::vector<double>& thresholds_nN);

}  // namespace mbtfm::statistics
