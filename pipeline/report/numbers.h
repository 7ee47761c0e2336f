/// Numbers for people: as many digits as they deserve.
#pragma once

#include <optional>
#include <string>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/figures.h"

namespace mbtfm::report {

using charts::readable;

/// Decimals that show two digits of an error. @param error  > 0
int decimals_for(double error);
/// None without an error above 0: as many as each number needs.
std::optional<int> decimals_for(const std::optional<double>& error);

/// No more than three significant digits and no more than so many decimals; without these, three significant digits.
std::string rounded(double value, std::optional<int> decimals);
/// "–" for none.
std::string rounded(const std::optional<double>& value, std::optional<int> decimals);

/// Both to two digits of the error: "412 ± 21 nN", "171.3 ± 4.4 nN"; without an error above 0 "412 nN".
std::string with_error(double value, std::optional<double> error, const char* unit);
/// The same without a unit.
std::string with_error(double value, std::optional<double> error);

/// A number and the ends of its interval, to two digits of half the interval: "3.3", "2.2 to 5.0".
struct WithInterval {
  std::string value, interval;
};
WithInterval with_interval(double value, double low, double high);

/// Of a figure: a number as above, a list with commas.
std::string text_of_figure(const Value& value);

/// "+0.3", "−0.3", "0.0"
std::string with_sign(double value, int decimals);

/// A digit times a power of ten, as HTML.
std::string power_of_ten(double value);

}  // namespace mbtfm::report
