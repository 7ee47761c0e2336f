#include "pipeline/report/numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/listed.h"
#include "pipeline/contract/with_error.h"

namespace mbtfm::report {

namespace {

/// A true minus, and no sign of a number that shows as zero.
std::string with_minus(const std::string& text) {
  const bool has_sign = text[0] == '-' || text[0] == '+';
  if (has_sign && text.find_first_of("123456789") == std::string::npos) return text.substr(1);
  return text[0] == '-' ? "−" + text.substr(1) : text;
}

}  // namespace

int decimals_for(double error) { return std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 9); }

std::optional<int> decimals_for(const std::optional<double>& error) {
  return error && *error > 0 ? std::optional(decimals_for(*error)) : std::nullopt;
}

std::string rounded(double value, std::optional<int> decimals) {
  if (!decimals) return readable(value);
  const int exponent = value != 0 ? static_cast<int>(std::floor(std::log10(std::abs(value)))) : 0;
  return with_minus(fmt::format("{:.{}f}", value, std::clamp(2 - exponent, 0, *decimals)));
}

std::string rounded(const std::optional<double>& value, std::optional<int> decimals) {
  return value ? rounded(*value, decimals) : "–";
}

std::string with_error(double value, std::optional<double> error) {
  if (!error || !(*error > 0)) return readable(value);
  std::string text = mbtfm::with_error(value, *error);
  return with_minus(text.replace(text.find("+-"), 2, "±"));
}

std::string with_error(double value, std::optional<double> error, const char* unit) {
  return with_error(value, error) + " " + unit;
}

WithInterval with_interval(double value, double low, double high) {
  const double half = (high - low) / 2;
  if (!(half > 0) || std::isinf(half)) return {readable(value), readable(low) + " to " + readable(high)};
  const auto shown = [decimals = decimals_for(half)](double v) {
    return with_minus(fmt::format("{:.{}f}", v, decimals));
  };
  return {shown(value), shown(low) + " to " + shown(high)};
}

std::string text_of_figure(const Value& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using V = std::decay_t<decltype(v)>;
        if constexpr (!std::is_arithmetic_v<V> && !std::is_same_v<V, std::string>) return listed(v);
        if constexpr (std::is_same_v<V, std::string>) return v;
        if constexpr (std::is_same_v<V, bool>) return v ? "yes" : "no";
        if constexpr (std::is_same_v<V, double>) return readable(v);
        if constexpr (std::is_same_v<V, std::int64_t>) return std::to_string(v);
      },
      value);
}

std::string with_sign(double value, int decimals) { return with_minus(fmt::format("{:+.{}f}", value, decimals)); }

std::string power_of_ten(double value) {
  if (value == 0) return "0";
  const std::string text = fmt::format("{:.0e}", value);
  const auto e = text.find('e');
  const int exponent = std::stoi(text.substr(e + 1));
  return fmt::format("{}&nbsp;×&nbsp;10<sup>{}{}</sup>", text.substr(0, e), exponent < 0 ? "−" : "",
                     std::abs(exponent));
}

}  // namespace mbtfm::report
