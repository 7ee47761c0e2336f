#include "pipeline/charts/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbtfm::charts {

namespace {

constexpr double kLeft_px = 84, kRight_px = 14, kTop_px = 84, kBottom_px = 50, kCaptionLine_px = 20;
constexpr double kInkWidth_px = Chart::kWidth_px - kLeft_px - kRight_px;
constexpr double kInkHeight_px = Chart::kHeight_px - kTop_px - kBottom_px;

/// Where a value lies between the ends of its axis, 0 to 1; NaN where it has no place.
double share(const Axis& axis, double value) {
  if (axis.scale == Scale::linear) return (value - axis.low) / (axis.high - axis.low);
  return value > 0 ? std::log(value / axis.low) / std::log(axis.high / axis.low) : std::nan("");
}

/// Of a logarithmic axis: powers of ten, thinned out where they are many, with twos and fives where they are few.
std::vector<double> log_ticks(double low, double high) {
  const double decades = std::log10(high / low);
  const int step = std::max(1, static_cast<int>(std::ceil(decades / 6)));
  std::vector<double> list;
  for (int power = static_cast<int>(std::floor(std::log10(low))); power <= std::log10(high); ++power) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      if (digit > 1 && decades > 2.5) continue;
      const double value = digit * std::pow(10.0, power);
      if (power % step == 0 && value >= low && value <= high) list.push_back(value);
    }
  }
  return list;
}

std::vector<double> ticks_of(const Axis& axis) {
  const std::vector<double> list =
      axis.scale == Scale::logarithmic ? log_ticks(axis.low, axis.high) : std::vector<double>();
  return list.size() < 3 ? ticks(axis.low, axis.high) : list;  // within less than a decade a logarithm is hardly bent
}

std::string text(double x, double y, const char* anchor, const std::string& content) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     html_escaped(content));
}

}  // namespace

std::string html_escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
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
  const double fine = round_below((high - low) / 5);
  const double step = (high - low) / fine <= 5 ? fine : round_below(2.5 * fine);
  std::vector<double> list;
  for (double t = std::ceil(low / step) * step; t <= high + 1e-9 * step; t += step)
    list.push_back(std::abs(t) < step / 2 ? 0 : t);
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

Chart::Chart(std::string title, Axis x, Axis y) : title_(std::move(title)), x_(std::move(x)), y_(std::move(y)) {}

Vec2 Chart::place(Vec2 value) const {
  // what is far outside stays so without numbers that a reader of SVG refuses
  const double right = std::clamp(share(x_, value.x), -10.0, 10.0), up = std::clamp(share(y_, value.y), -10.0, 10.0);
  return {kLeft_px + kInkWidth_px * right, kTop_px + kInkHeight_px * (1 - up)};
}

void Chart::subtitle(std::string text, std::string colour) {
  subtitle_ = std::move(text);
  subtitle_colour_ = std::move(colour);
}

void Chart::second_x_axis(std::string label, double factor) {
  second_label_ = std::move(label);
  second_factor_ = factor;
}

void Chart::curve(const std::vector<Vec2>& points, const std::string& style) {
  std::string list;
  for (const Vec2 p : points) {
    const Vec2 at = place(p);
    if (is_finite(at)) list += fmt::format("{:.1f},{:.1f} ", at.x, at.y);
  }
  body_ += fmt::format("<polyline points=\"{}\" style=\"fill:none;{}\"/>\n", list, style);
}

void Chart::dot(Vec2 value, double radius_px, const std::string& style, const std::string& hover) {
  const Vec2 at = place(value);
  if (!is_finite(at)) return;
  body_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" style=\"{}\"><title>{}</title></circle>\n",
                       at.x, at.y, radius_px, style, html_escaped(hover));
}

void Chart::label(Vec2 value, const std::string& content, const std::string& colour) {
  const Vec2 at = place(value);
  if (!is_finite(at)) return;
  body_ += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"11\" fill=\"{}\" style=\"stroke:#fff;stroke-width:3;"
      "stroke-linejoin:round;paint-order:stroke\">{}</text>\n",
      at.x + 7, at.y + 4, colour, html_escaped(content));
}

void Chart::upright(double x, const std::string& style) {
  const double at = kLeft_px + kInkWidth_px * std::clamp(share(x_, x), -10.0, 10.0);
  body_ += fmt::format("<path d=\"M{:.1f},{}v{}\" style=\"{}\"/>\n", at, kTop_px, kInkHeight_px, style);
}

void Chart::level(double y, const std::string& style) {
  const double at = kTop_px + kInkHeight_px * (1 - std::clamp(share(y_, y), -10.0, 10.0));
  body_ += fmt::format("<path d=\"M{},{:.1f}h{}\" style=\"{}\"/>\n", kLeft_px, at, kInkWidth_px, style);
}

void Chart::key(const std::string& line, const std::string& colour) { keys_.emplace_back(line, colour); }

std::string Chart::str() const {
  const double bottom = kTop_px + kInkHeight_px, right = kLeft_px + kInkWidth_px, middle = kLeft_px + kInkWidth_px / 2;
  std::string svg =
      fmt::format("<text x=\"{}\" y=\"18\" font-weight=\"600\">{}</text>\n", kLeft_px, html_escaped(title_));
  svg += fmt::format("<text x=\"{}\" y=\"37\" fill=\"{}\">{}</text>\n", kLeft_px, subtitle_colour_,
                     html_escaped(subtitle_));
  for (const double tick : ticks_of(x_)) {
    const double at = place({tick, y_.low}).x;
    svg += fmt::format("<path d=\"M{0:.1f},{1}V{2}\" stroke=\"#e3e5e8\"/>", at, kTop_px, bottom) +
           text(at, bottom + 17, "middle", readable(tick));
  }
  for (const double tick : ticks_of(y_)) {
    const double at = place({x_.low, tick}).y;
    svg += fmt::format("<path d=\"M{0},{1:.1f}H{2}\" stroke=\"#e3e5e8\"/>", kLeft_px, at, right) +
           text(kLeft_px - 6, at + 5, "end", readable(tick));
  }
  if (second_factor_ > 0) {
    const Axis second{second_label_, second_factor_ * x_.low, second_factor_ * x_.high, x_.scale};
    for (const double tick : ticks_of(second)) {
      const double at = kLeft_px + kInkWidth_px * share(second, tick);
      svg += fmt::format("<path d=\"M{0:.1f},{1}v-4\" stroke=\"#444\"/>", at, kTop_px) +
             text(at, kTop_px - 7, "middle", readable(tick));
    }
    svg += text(middle, kTop_px - 23, "middle", second_label_);
  }
  svg += text(middle, bottom + 39, "middle", x_.label);
  svg += fmt::format("<text transform=\"translate(15,{}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     kTop_px + kInkHeight_px / 2, html_escaped(y_.label));
  // an inner <svg> cuts off what reaches beyond the frame
  svg += fmt::format("<svg x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" viewBox=\"{0} {1} {2} {3}\">\n", kLeft_px,
                     kTop_px, kInkWidth_px, kInkHeight_px) +
         body_ + "</svg>\n";
  svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444\"/>\n", kLeft_px,
                     kTop_px, kInkWidth_px, kInkHeight_px);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    const bool is_left = key_side_ == KeySide::left;
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"{}\" fill=\"{}\" style=\"stroke:#fff;stroke-width:4;"
        "stroke-linejoin:round;paint-order:stroke\">{}</text>\n",
        is_left ? kLeft_px + 10 : right - 10, kTop_px + 20 + 18 * static_cast<double>(i), is_left ? "start" : "end",
        keys_[i].second, html_escaped(keys_[i].first));
  }
  return svg;
}

std::string svg_file(const std::vector<Chart>& charts, int n_columns, const std::vector<std::string>& caption) {
  const int n_rows = (static_cast<int>(charts.size()) + n_columns - 1) / n_columns;
  const double width = n_columns * Chart::kWidth_px, below = n_rows * Chart::kHeight_px;
  const double height = below + kCaptionLine_px * (static_cast<double>(caption.size()) + 0.5);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"system-ui,DejaVu Sans,sans-serif\" font-size=\"14\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      width, height);
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const int column = static_cast<int>(i) % n_columns, row = static_cast<int>(i) / n_columns;
    svg += fmt::format("<g transform=\"translate({},{})\">\n", column * Chart::kWidth_px, row * Chart::kHeight_px) +
           charts[i].str() + "</g>\n";
  }
  for (std::size_t i = 0; i < caption.size(); ++i) {
    svg += text(20, below + kCaptionLine_px * (static_cast<double>(i) + 0.7), "start", caption[i]);
  }
  return svg + "</svg>\n";
}

}  // namespace mbtfm::charts
