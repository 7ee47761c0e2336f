#include "pipeline/contract/numbers.h"

#include <charconv>
#include <cmath>
#include <cstdio>

namespace mbtfm {

std::string shortest(double value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, result.ptr};
}

std::string significant(double value, int digits) {
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, digits);
  return {buffer, result.ptr};
}

std::string brief(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  constexpr double kReadsAsExponent = 999.5, kLeaveExponent = 1e6;
  const double size = std::abs(value);
  if (size >= kReadsAsExponent && size < kLeaveExponent) std::snprintf(text, sizeof text, "%.0f", std::stod(text));
  return text;
}

}  // namespace mbtfm
