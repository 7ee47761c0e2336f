#include "pipeline/charts/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pipeline/files/names.h"

namespace mbtfm::charts {

std::string html_escaped(std::string_view text) {
  using Entity = std::pair<char, std::string_view>;
  static constexpr Entity kEntities[] = {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}};
  std::string safe;
  for (const char c : files::shown_name(text)) {
    const auto entity = std::ranges::find(kEntities, c, &Entity::first);
    safe += entity == std::end(kEntities) ? std::string_view(&c, 1) : entity->second;
  }
  return safe;
}

std::string readable(double value) {
  const std::string text = std::abs(value) >= 100 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
  return !text.empty() && text[0] == '-' ? "−" + text.substr(1) : text;
}

double round_below(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / power;
  return power * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

std::vector<double> ticks(double low, double high) {
  if (!(high > low) || !std::isfinite(high - low)) return {};
  const double fine = round_below((high - low) / 5);
  const double step = (high - low) / fine <= 5 ? fine : round_below(2.5 * fine);
  std::vector<double> list;
  const double first = std::ceil(low / step) * step;
  const int n = static_cast<int>((high - first) / step + 1e-9) + 1;  // counted: a step may be lost beside large values
  for (int i = 0; i < n; ++i) {
    const double t = first + i * step;
    list.push_back(std::abs(t) < step / 2 ? 0 : t);
  }
  return list;
}

Axis axis_over(std::string label, const std::vector<double>& values, Scale scale) {
  Axis axis{.label = std::move(label), .low = 0, .high = 0, .scale = scale};
  bool is_first = true;
  for (const double v : values) {
    if (!std::isfinite(v) || (scale == Scale::logarithmic && v <= 0)) continue;
    axis.low = is_first ? v : std::min(axis.low, v);
    axis.high = is_first ? v : std::max(axis.high, v);
    is_first = false;
  }
  constexpr double kRoom = 0.05;  // of the range
  if (scale == Scale::logarithmic) {
    if (is_first) axis.low = axis.high = 1;
    const double room = std::max(std::pow(axis.high / axis.low, kRoom), 1.1);
    return {axis.label, axis.low / room, axis.high * room, scale};
  }
  const double room = axis.high > axis.low ? kRoom * (axis.high - axis.low) : std::max(std::abs(axis.high), 1.0);
  return {axis.label, axis.low - room, axis.high + room, scale};
}

Axis row_axis(const std::vector<std::string>& names) {
  const double n = static_cast<double>(names.size());
  Axis axis{.label = {}, .low = n - 0.5, .high = -0.5};
  for (std::size_t i = 0; i < names.size(); ++i) axis.names.emplace_back(i, names[i]);
  return axis;
}

double share(const Axis& axis, double value) {
  if (axis.scale == Scale::linear) return (value - axis.low) / (axis.high - axis.low);
  return value > 0 ? std::log(value / axis.low) / std::log(axis.high / axis.low) : std::nan("");
}

namespace {

constexpr double kFrameHeight_px = 236;

/// With room between its ends: values that are all equal, or none, have no place else.
Axis drawable(Axis axis) {
  const bool is_linear = axis.scale == Scale::linear;
  const bool is_range = std::isfinite(axis.low) && std::isfinite(axis.high) && axis.low != axis.high;
  if (is_range && (is_linear || (axis.low > 0 && axis.high > 0))) return axis;
  if (!std::isfinite(axis.low) || (!is_linear && axis.low <= 0)) axis.low = is_linear ? 0 : 1;
  axis.high = is_linear ? axis.low + std::max(1.0, std::abs(axis.low)) : 10 * axis.low;
  return axis;
}

}  // namespace

Chart::Chart(std::string title, Axis x, Axis y)
    : title_(std::move(title)),
      x_(drawable(std::move(x))),
      y_(drawable(std::move(y))),
      frame_height_px_(kFrameHeight_px) {}

void Chart::pieces(const std::vector<std::pair<Vec2, Vec2>>& pieces, const std::string& style,
                   const std::string& hover) {
  std::vector<Vec2> ends;
  for (const auto& [a, b] : pieces) ends.insert(ends.end(), {a, b});
  marks_.push_back({Mark::Kind::pieces, std::move(ends), style, hover});
}

namespace {

using Rgb = std::array<int, 3>;

std::optional<Rgb> rgb_of(const std::string& colour) {
  Rgb rgb{};
  if (colour.size() != 7 || colour.find_first_not_of("0123456789abcdefABCDEF", 1) != std::string::npos) return {};
  for (std::size_t i = 0; i < 3; ++i) rgb[i] = std::stoi(colour.substr(1 + 2 * i, 2), nullptr, 16);
  return colour.front() == '#' ? std::optional(rgb) : std::nullopt;
}

/// Of light, by the definition in WCAG 2.1.
double luminance(const Rgb& rgb) {
  constexpr double kShares[] = {0.2126, 0.7152, 0.0722};
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double v = rgb[i] / 255.0;
    sum += kShares[i] * (v <= 0.03928 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  }
  return sum;
}

}  // namespace

double contrast_to_white(const std::string& colour) {
  const std::optional<Rgb> rgb = rgb_of(colour);
  return 1.05 / ((rgb ? luminance(*rgb) : 0) + 0.05);
}

std::string readable_on_white(const std::string& colour) {
  constexpr double kLeast = 4.5;
  const std::optional<Rgb> rgb = rgb_of(colour);
  if (!rgb) return colour;
  std::string dark = colour;
  for (int percent = 99; contrast_to_white(dark) < kLeast; --percent)
    dark = fmt::format("#{:02X}{:02X}{:02X}", percent * (*rgb)[0] / 100, percent * (*rgb)[1] / 100,
                       percent * (*rgb)[2] / 100);
  return dark;
}

std::string arrow_path(Vec2 shift_px) {
  const double length = norm(shift_px);
  if (length < 0.5) return {};
  const Vec2 back = (-std::min(5.0, 0.4 * length) / length) * shift_px;
  const Vec2 side = 0.5 * Vec2{-back.y, back.x};
  return fmt::format("M0,0l{:.1f},{:.1f}m{:.1f},{:.1f}l{:.1f},{:.1f}l{:.1f},{:.1f}", shift_px.x, shift_px.y,
                     back.x + side.x, back.y + side.y, -back.x - side.x, -back.y - side.y, back.x - side.x,
                     back.y - side.y);
}

}  // namespace mbtfm::charts
