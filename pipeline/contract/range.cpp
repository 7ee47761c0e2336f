#include "pipeline/contract/range.h"

#include <array>
#include <cmath>

#include "pipeline/contract/numbers.h"

namespace mbtfm {

bool is_inside(const Range& range, double value) {
  const bool is_above = range.excludes_low ? value > range.low : value >= range.low;
  const bool is_below = range.excludes_high ? value < range.high : value <= range.high;
  return is_above && is_below;
}

std::string describe(const std::string& noun, const Range& range) {
  std::string text = noun;
  if (std::isfinite(range.low)) text += (range.excludes_low ? " > " : " >= ") + shortest(range.low);
  if (std::isfinite(range.high)) {
    text += std::string(std::isfinite(range.low) ? " and" : "") + (range.excludes_high ? " < " : " <= ");
    text += shortest(range.high);
  }
  return text;
}

std::string unit_slip(std::string_view name, double value, const Range& range) {
  struct Unit {
    std::string_view unit, smaller, larger;
  };
  constexpr std::array<Unit, 3> kUnits = {{{"um", "nm", "mm"}, {"kPa", "Pa", "MPa"}, {"nN", "pN", "uN"}}};
  for (const auto& [unit, smaller, larger] : kUnits) {
    if (!name.ends_with("_" + std::string(unit))) continue;
    const bool is_large = value > range.high;
    const double meant = is_large ? 1e-3 * value : 1e3 * value;
    if (is_inside(range, value) || !(value > 0) || !is_inside(range, meant)) return {};
    return "the unit is " + std::string(unit) + ": " + shortest(value) + " " +
           std::string(is_large ? smaller : larger) + " is " + shortest(meant) + " " + std::string(unit);
  }
  return {};
}

}  // namespace mbtfm
