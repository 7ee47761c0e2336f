/// Charts as SVG.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/charts/chart.h"

namespace mbtfm::charts {
namespace {

constexpr double kLeft_px = 84, kTop_px = 84, kBottom_px = 50, kCaptionLine_px = 20;

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

/// A power of ten with many zeros, as 10⁻⁸.
std::string tick_text(double value) {
  const double power = std::log10(std::abs(value));
  if (value <= 0 || std::abs(power) < 3.5 || std::abs(power - std::round(power)) > 1e-9) return readable(value);
  static constexpr const char* kRaised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = power < 0 ? "10⁻" : "10";
  for (const char digit : std::to_string(std::abs(std::lround(power)))) text += kRaised[digit - '0'];
  return text;
}

/// value, text
std::vector<std::pair<double, std::string>> ticks_of(const Axis& axis) {
  if (!axis.names.empty()) return axis.names;
  const auto [low, high] = std::minmax(axis.low, axis.high);
  std::vector<double> values = axis.scale == Scale::logarithmic ? log_ticks(low, high) : std::vector<double>();
  if (values.size() < 3) values = ticks(low, high);  // within less than a decade a logarithm is hardly bent
  std::vector<std::pair<double, std::string>> list;
  for (const double value : values)
    list.emplace_back(value, axis.scale == Scale::logarithmic ? tick_text(value) : readable(value));
  return list;
}

std::string text(double x, double y, const char* anchor, const std::string& content) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     html_escaped(content));
}

/// The frame in px and where values lie in it.
struct Frame {
  const Axis &x_axis, &y_axis;
  double height_px;

  // what is far outside stays so without numbers that a reader of SVG refuses
  double x(double value) const {
    return kLeft_px + Chart::kFrameWidth_px * std::clamp(share(x_axis, value), -10.0, 10.0);
  }
  double y(double value) const { return kTop_px + height_px * (1 - std::clamp(share(y_axis, value), -10.0, 10.0)); }
  Vec2 place(Vec2 value) const { return {x(value.x), y(value.y)}; }
};

std::string element(const std::string& tag, const std::string& attributes, const Mark& mark, const char* style = "") {
  const std::string open = fmt::format("<{} {} style=\"{}{}\"", tag, attributes, style, mark.style);
  return mark.hover.empty() ? open + "/>\n" : open + "><title>" + html_escaped(mark.hover) + "</title></" + tag + ">\n";
}

std::string points_of(const Mark& mark, const Frame& frame) {
  std::string list;
  for (const Vec2 p : mark.points) {
    const Vec2 at = frame.place(p);
    if (is_finite(at)) list += fmt::format("{:.1f},{:.1f} ", at.x, at.y);
  }
  return "points=\"" + list + "\"";
}

std::string pieces_of(const Mark& mark, const Frame& frame) {
  std::string path;
  for (std::size_t i = 0; i + 1 < mark.points.size(); i += 2) {
    const Vec2 a = frame.place(mark.points[i]), b = frame.place(mark.points[i + 1]);
    if (is_finite(a) && is_finite(b)) path += fmt::format("M{:.1f},{:.1f}L{:.1f},{:.1f}", a.x, a.y, b.x, b.y);
  }
  return "d=\"" + path + "\"";
}

std::string error_bar(const Mark& mark, Vec2 a, Vec2 b) {
  constexpr double kStop_px = 4;  // half of its length
  const Vec2 along = b - a;
  const double length = norm(along);
  const Vec2 stop = length > 0 ? (kStop_px / length) * Vec2{-along.y, along.x} : Vec2{kStop_px, 0};
  std::string path = fmt::format("M{:.1f},{:.1f}L{:.1f},{:.1f}", a.x, a.y, b.x, b.y);
  for (const Vec2 end : {a, b})
    path += fmt::format("M{:.1f},{:.1f}L{:.1f},{:.1f}", end.x - stop.x, end.y - stop.y, end.x + stop.x, end.y + stop.y);
  return element("path", "d=\"" + path + "\"", mark, "fill:none;");
}

/// x, y, width and height of what lies between two corners.
std::string rectangle(Vec2 a, Vec2 b) {
  return fmt::format("x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"", std::min(a.x, b.x),
                     std::min(a.y, b.y), std::abs(b.x - a.x), std::abs(b.y - a.y));
}

std::string svg_of(const Mark& mark, const Frame& frame) {
  using Kind = Mark::Kind;
  if (mark.kind == Kind::curve) return element("polyline", points_of(mark, frame), mark, "fill:none;");
  if (mark.kind == Kind::polygon) return element("polygon", points_of(mark, frame), mark);
  if (mark.kind == Kind::pieces) return element("path", pieces_of(mark, frame), mark, "fill:none;");
  const Vec2 at = frame.place(mark.points.front()), to = frame.place(mark.points.back());
  if (!is_finite(at) || !is_finite(to)) return {};
  switch (mark.kind) {
    case Kind::bar:
      return element("rect", rectangle(at, to), mark);
    case Kind::error:
      return error_bar(mark, at, to);
    case Kind::dot:
      return element("circle", fmt::format("cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"", at.x, at.y, mark.radius_px),
                     mark);
    case Kind::diamond:
      return element("path",
                     fmt::format("d=\"M{0:.1f},{1:.1f}l{2},{2}l-{2},{2}l-{2},-{2}z\"", at.x, at.y - mark.radius_px,
                                 mark.radius_px),
                     mark);
    case Kind::arrow:
      return element(
          "path", fmt::format("transform=\"translate({:.1f},{:.1f})\" d=\"{}\"", at.x, at.y, arrow_path(mark.shift_px)),
          mark, "fill:none;");
    case Kind::upright:
      return element("path", fmt::format("d=\"M{:.1f},{}v{}\"", at.x, kTop_px, frame.height_px), mark);
    case Kind::level:
      return element("path", fmt::format("d=\"M{},{:.1f}h{}\"", kLeft_px, at.y, Chart::kFrameWidth_px), mark);
    case Kind::label:
      return fmt::format(
          "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" "
          "style=\"font-weight:600;stroke:#fff;stroke-width:4;stroke-linejoin:round;paint-order:stroke\">{}</text>\n",
          at.x, at.y + 5, html_escaped(mark.text));
    case Kind::picture:
      return fmt::format("<image {} preserveAspectRatio=\"none\" href=\"{}\"/>\n", rectangle(at, to),
                         html_escaped(mark.text));
    default:
      return {};
  }
}

std::string axes(const Frame& frame) {
  const double bottom = kTop_px + frame.height_px, right = kLeft_px + Chart::kFrameWidth_px;
  std::string svg;
  for (const auto& [value, name] : ticks_of(frame.x_axis)) {
    if (frame.x_axis.names.empty())
      svg += fmt::format("<path d=\"M{0:.1f},{1}V{2}\" stroke=\"#e3e5e8\"/>", frame.x(value), kTop_px, bottom);
    svg += text(frame.x(value), bottom + 17, "middle", name);
  }
  for (const auto& [value, name] : ticks_of(frame.y_axis)) {
    svg += fmt::format("<path d=\"M{0},{1:.1f}H{2}\" stroke=\"#e3e5e8\"/>", kLeft_px, frame.y(value), right) +
           text(kLeft_px - 6, frame.y(value) + 5, "end", name);
  }
  return svg;
}

std::string upper_axis(const Axis& axis) {
  std::string svg;
  for (const auto& [value, name] : ticks_of(axis)) {
    const double at = kLeft_px + Chart::kFrameWidth_px * share(axis, value);
    svg += fmt::format("<path d=\"M{0:.1f},{1}v-4\" stroke=\"#444\"/>", at, kTop_px) +
           text(at, kTop_px - 7, "middle", name);
  }
  return svg + text(kLeft_px + Chart::kFrameWidth_px / 2, kTop_px - 23, "middle", axis.label);
}

/// Squares of colour, each before its text.
std::string key_row(const std::vector<std::pair<std::string, std::string>>& keys) {
  constexpr double kSquare_px = 11, kGap_px = 16, kLetter_px = 8;
  const double baseline = kTop_px - 10;
  double x = kLeft_px;
  std::string svg;
  for (const auto& [text, colour] : keys) {
    const auto n_characters = std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; });  // of UTF-8
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>\n", x,
                       baseline - kSquare_px + 1, kSquare_px, kSquare_px, colour);
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\">{}</text>\n", x + kSquare_px + 4, baseline, html_escaped(text));
    x += kSquare_px + 4 + kLetter_px * static_cast<double>(n_characters) + kGap_px;
  }
  return svg;
}

}  // namespace

double Chart::ink_height_px() const {
  return are_scales_same_ ? Chart::kFrameWidth_px * std::abs((y_.high - y_.low) / (x_.high - x_.low))
                          : frame_height_px_;
}

double Chart::height_px() const { return kTop_px + ink_height_px() + kBottom_px; }

std::string Chart::str() const {
  const Frame frame{x_, y_, ink_height_px()};
  const double bottom = kTop_px + frame.height_px, right = kLeft_px + Chart::kFrameWidth_px;
  std::string svg =
      fmt::format("<text x=\"{}\" y=\"18\" font-weight=\"600\">{}</text>\n", kLeft_px, html_escaped(title_));
  svg += fmt::format("<text x=\"{}\" y=\"37\" fill=\"{}\">{}</text>\n", kLeft_px, subtitle_colour_,
                     html_escaped(subtitle_));
  svg += axes(frame);
  if (second_factor_ > 0)
    svg += upper_axis({second_label_, second_factor_ * x_.low, second_factor_ * x_.high, x_.scale});
  svg += text(kLeft_px + Chart::kFrameWidth_px / 2, bottom + 39, "middle", x_.label);
  svg += fmt::format("<text transform=\"translate(15,{}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     kTop_px + frame.height_px / 2, html_escaped(y_.label));
  // an inner <svg> cuts off what reaches beyond the frame
  svg += fmt::format("<svg x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" viewBox=\"{0} {1} {2} {3}\">\n", kLeft_px,
                     kTop_px, Chart::kFrameWidth_px, frame.height_px);
  for (const Mark& mark : marks_) svg += svg_of(mark, frame);
  svg += "</svg>\n";
  svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444\"/>\n", kLeft_px,
                     kTop_px, Chart::kFrameWidth_px, frame.height_px);
  if (key_side_ == KeySide::above) return svg + key_row(keys_);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    const bool is_left = key_side_ == KeySide::left;
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"{}\" fill=\"{}\" "
        "style=\"stroke:#fff;stroke-width:4;stroke-linejoin:round;paint-order:stroke\">{}</text>\n",
        is_left ? kLeft_px + 10 : right - 10, kTop_px + 20 + 18 * static_cast<double>(i), is_left ? "start" : "end",
        readable_on_white(keys_[i].second), html_escaped(keys_[i].first));
  }
  return svg;
}

std::string svg_file(const std::vector<Chart>& charts, int n_columns, const std::vector<std::string>& caption) {
  const double width = n_columns * Chart::kWidth_px;
  std::string body;
  double below = 0, row_height = 0;
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const int column = static_cast<int>(i) % n_columns;
    if (column == 0) {
      below += row_height;
      row_height = 0;
    }
    row_height = std::max(row_height, charts[i].height_px());
    body += fmt::format("<g transform=\"translate({},{})\">\n", column * Chart::kWidth_px, below) + charts[i].str() +
            "</g>\n";
  }
  below += row_height;
  for (std::size_t i = 0; i < caption.size(); ++i)
    body += text(20, below + kCaptionLine_px * (static_cast<double>(i) + 0.7), "start", caption[i]);
  const double height = below + kCaptionLine_px * (static_cast<double>(caption.size()) + 0.5);
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
             "font-family=\"system-ui,DejaVu Sans,sans-serif\" font-size=\"14\">\n"
             "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
             width, height) +
         body + "</svg>\n";
}

}  // namespace mbtfm::charts
