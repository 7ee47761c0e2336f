/// fit.json, and figures as JSON.
#pragma once

#include "pipeline/contract/cell.h"
#include "pipeline/contract/fit_summary.h"
#include "pipeline/contract/path.h"

namespace mbtfm::files {

FitSummary read_fit_summary(const Path& file);
/// @param fibres  whose types are written beside the tensions of the error budget
void write_fit_summary(const Path& file, const FitSummary& summary, const std::vector<Fibre>& fibres = {});
/// Named figures as one JSON object.
void write_figures(const Path& file, const Figures& figures);

}  // namespace mbtfm::files
