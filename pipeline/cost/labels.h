/// Names beside the dots of a chart.
#pragma once

#include <string>
#include <vector>

#include "pipeline/charts/chart.h"

namespace mbtfm::cost {

struct NamedDot {
  Vec2 at;  ///< in the units of the axes
  std::string name;
};

/// Write each name beside its dot, the first ones first, where it covers neither a dot nor a name nor the key in the
/// upper right corner; where there is no room it is left out: the table has it, too.
/// @param x, y  logarithmic axes of the chart
void add_names(charts::Chart& chart, const charts::Axis& x, const charts::Axis& y, double frame_height_px,
               const std::vector<NamedDot>& dots, const std::vector<std::string>& key);

}  // namespace mbtfm::cost
