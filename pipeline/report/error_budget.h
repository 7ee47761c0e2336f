/// What the error of each tension, and of the total force, is made of.
#pragma once

#include <string>

namespace mbtfm::report {

struct CellResults;

/// A chart and a table, as HTML; empty where the fit states no budget.
std::string error_budget_html(const CellResults& results);

}  // namespace mbtfm::report
