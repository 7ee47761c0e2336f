/// fit.json, and figures as JSON.
#pragma once

#include <map>
#include <optional>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/fit_summary.h"
#include "pipeline/contract/path.h"

namespace mbtfm::files {

FitSummary read_fit_summary(const Path& file);
/// @param fibres  whose types are written beside the tensions of the error budget
void write_fit_summary(const Path& file, const FitSummary& summary, const std::vector<Fibre>& fibres = {});

/// The total force of a time series.
struct ForceOverTime {
  int n_frames = 0, n_without_fit = 0;
  double first_nN = 0, last_nN = 0;
  double largest_change_nN = 0;  ///< from the first frame, with its sign
};
/// Nothing for a cell of one frame. @throws InputError where 4_fit/frames.csv is malformed
std::optional<ForceOverTime> force_over_time(const Path& cell);

/// What a cell with fibres comes to, in short.
struct CellResult {
  struct OfType {
    int n = 0;
    double mean_nN = 0;
  };
  FitSummary fit;
  std::optional<double> total_error_nN = {};  ///< of the whole error budget
  std::map<FibreType, OfType> types = {};
  int n_fibres = 0, n_uncertain = 0;
  std::optional<ForceOverTime> over_time = {};
};
CellResult read_cell_result(const Path& cell);

/// Named figures as one JSON object.
void write_figures(const Path& file, const Figures& figures);

}  // namespace mbtfm::files
