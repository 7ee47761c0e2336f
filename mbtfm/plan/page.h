/// The plan as pictures and as a page that stands alone.
#pragma once

#include <string>
#include <vector>

#include "pipeline/charts/chart.h"

namespace mbtfm::plan {

struct Plan;

/// A chart for each noise: standard error of the middle fibre over density, a curve for each gel, the target as a line.
std::vector<charts::Chart> charts_of(const Plan& plan);
std::string svg_of(const Plan& plan);
std::string html_of(const Plan& plan);

}  // namespace mbtfm::plan
