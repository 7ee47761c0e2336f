/// Colours that stand for numbers.
#pragma once

#include <string>

namespace mbtfm::report {

/// A map from numbers to colours that differ in lightness, so that colour-blind eyes and grey printers tell them apart.
struct ColourScale {
  double low = 0, high = 1;
  std::string label;  ///< with the unit
  std::string colour(double value) const;
};

/// End of a colour bar from zero that shows `value`: the next of the bar's ticks. 0 where nothing is positive.
double round_end(double value);

/// The scale as HTML; nothing where it has no width.
std::string colour_bar(const ColourScale& scale);
/// What goes below a chart to explain it, as HTML.
std::string legend(const std::string& items);

}  // namespace mbtfm::report
