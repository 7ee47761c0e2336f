#include "pipeline/report/colours.h"

#include <fmt/format.h>

#include "pipeline/charts/chart.h"
#include "pipeline/charts/colour_map.h"

namespace mbtfm::report {
std::string ColourScale::colour(double value) const {
  return charts::hex(charts::colour_at(charts::ColourMap::plasma, high > low ? (value - low) / (high - low) : 0));
}

double round_end(double value) {
  if (!(value > 0)) return 0;
  const std::vector<double> list = charts::ticks(0, value);
  return list.back() >= value ? value : list.back() + list[1];
}

std::string colour_bar(const ColourScale& scale) {
  if (!(scale.high > scale.low)) return {};
  std::string stops, numbers;
  for (const double share : charts::stops_of(charts::ColourMap::plasma))
    stops += "," + scale.colour(scale.low + share * (scale.high - scale.low));
  for (const double tick : charts::ticks(scale.low, scale.high)) {
    numbers += fmt::format("<span style=\"left:{:.1f}%\">{}</span>",
                           100 * (tick - scale.low) / (scale.high - scale.low), charts::readable(tick));
  }
  return fmt::format(
      "<span class=\"bar\"><span class=\"ink\"><i style=\"background:linear-gradient(90deg{})\"></i>{}</span>{}</span>",
      stops, numbers, charts::html_escaped(scale.label));
}

std::string legend(const std::string& items) {
  return items.empty() ? items : "<div class=\"legend\">" + items + "</div>\n";
}

}  // namespace mbtfm::report
