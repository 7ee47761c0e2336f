/// The table of the fitted tensions, beside the truth where it is known.
#pragma once

#include <string>

#include "pipeline/report/page.h"

namespace mbtfm::report {

struct CellResults;

/// A row for the actin network, then one a fibre in the order of the plot.
Table tension_table(const CellResults& results);

/// How to read the table, and what it lacks, as paragraphs.
std::string tension_notes(const CellResults& results);

/// Of the fibres with an interval and a known truth, how many intervals hold the truth.
struct Coverage {
  int n_inside = 0, n = 0;
};
Coverage coverage_of(const CellResults& results);

}  // namespace mbtfm::report
