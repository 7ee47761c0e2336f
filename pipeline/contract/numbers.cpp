#include "pipeline/contract/numbers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "pipeline/contract/with_error.h"

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

namespace {

/// Both to this many decimals; below 0 to tens, hundreds ...
std::string to_decimals(double value, int decimals) {
  const double unit = std::pow(10.0, -decimals);
  const double rounded = std::round(value / unit) * unit + 0.0;  // never -0
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", std::max(0, decimals), rounded == 0 ? 0.0 : rounded);
  return text.data();
}

/// The two texts.
std::array<std::string, 2> texts_of(double value, double error) {
  constexpr double kLeast = 1e-9, kMost = 1e6;  // beyond, exponents read better
  if (!(error > kLeast && error < kMost && std::abs(value) < kMost)) return {brief(value), brief(error)};
  int decimals = 1 - static_cast<int>(std::floor(std::log10(error)));
  if (std::round(error * std::pow(10.0, decimals)) >= 100) --decimals;  // 0.0996 is 0.10
  return {to_decimals(value, decimals), to_decimals(error, decimals)};
}

}  // namespace

std::string with_error(double value, double error) {
  const auto [number, sigma] = texts_of(value, error);
  return number + " +- " + sigma;
}

std::string with_error(Vec2 value, Vec2 error) {
  const auto [x, sigma_x] = texts_of(value.x, error.x);
  const auto [y, sigma_y] = texts_of(value.y, error.y);
  return "(" + x + ", " + y + ") +- (" + sigma_x + ", " + sigma_y + ")";
}

}  // namespace mbtfm
