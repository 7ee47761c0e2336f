#include "pipeline/report/colours.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "pipeline/charts/chart.h"

namespace mbtfm::report {
namespace {

/// Plasma (S. van der Walt & N. Smith, matplotlib) without its lightest fifth, which is lost on white paper.
constexpr std::array<std::array<int, 3>, 8> kPlasma = {{{13, 8, 135},
                                                        {70, 3, 159},
                                                        {114, 1, 168},
                                                        {156, 23, 158},
                                                        {189, 55, 134},
                                                        {216, 87, 107},
                                                        {237, 121, 83},
                                                        {251, 159, 58}}};

}  // namespace

std::string ColourScale::colour(double value) const {
  const double share = high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.0;
  const double at = share * (kPlasma.size() - 1);
  const std::size_t i = std::min(kPlasma.size() - 2, static_cast<std::size_t>(at));
  std::string text = "#";
  for (int c = 0; c < 3; ++c) {
    const double mixed = kPlasma[i][c] + (at - static_cast<double>(i)) * (kPlasma[i + 1][c] - kPlasma[i][c]);
    text += fmt::format("{:02x}", static_cast<int>(mixed));
  }
  return text;
}

double round_end(double value) {
  if (!(value > 0)) return 0;
  const std::vector<double> list = charts::ticks(0, value);
  return list.back() >= value ? value : list.back() + list[1];
}

std::string colour_bar(const ColourScale& scale) {
  if (!(scale.high > scale.low)) return {};
  std::string stops, numbers;
  for (std::size_t i = 0; i < kPlasma.size(); ++i) {
    const double share = static_cast<double>(i) / (kPlasma.size() - 1);
    stops += "," + scale.colour(scale.low + share * (scale.high - scale.low));
  }
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
