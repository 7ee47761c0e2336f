/// Charts as SVG.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/charts/chart.h"

namespace mbtfm::charts {
namespace {

constexpr double kLeast_left_px = 84, kRight_px = 14, kTop_px = 84, kBottom_px = 50, kCaptionLine_px = 20;
constexpr double kLetter_px = 8;

double letters_of(const std::string& utf8) {
  return static_cast<double>(std::ranges::count_if(utf8, [](char c) { return (c & 0xC0) != 0x80; }));
}

double longest_name(const Axis& axis) {
  double longest = 0;
  for (const auto& [value, name] : axis.names) longest = std::max(longest, letters_of(name));
  return longest;
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
  double left_px, height_px;

  double right_px() const { return left_px + Chart::kFrameWidth_px; }
  double bottom_px() const { return kTop_px + height_px; }
  // what is far outside stays so without numbers that a reader of SVG refuses
  double x(double value) const {
    return left_px + Chart::kFrameWidth_px * std::clamp(share(x_axis, value), -10.0, 10.0);
  }
  double y(double value) const { return kTop_px + height_px * (1 - std::clamp(share(y_axis, value), -10.0, 10.0)); }
  Vec2 place(Vec2 value) const { return {x(value.x), y(value.y)}; }
};

/// Its style is that of the group around it.
std::string element(const std::string& tag, const std::string& attributes, const Mark& mark) {
  const std::string open = fmt::format("<{} {}", tag, attributes);
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
  return element("path", "d=\"" + path + "\"", mark);
}

/// x, y, width and height of what lies between two corners.
std::string rectangle(Vec2 a, Vec2 b) {
  return fmt::format("x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"", std::min(a.x, b.x),
                     std::min(a.y, b.y), std::abs(b.x - a.x), std::abs(b.y - a.y));
}

std::string svg_of(const Mark& mark, const Frame& frame) {
  using Kind = Mark::Kind;
  if (mark.kind == Kind::curve) return element("polyline", points_of(mark, frame), mark);
  if (mark.kind == Kind::polygon) return element("polygon", points_of(mark, frame), mark);
  if (mark.kind == Kind::pieces) return element("path", pieces_of(mark, frame), mark);
  const Vec2 at = frame.place(mark.points.front()), to = frame.place(mark.points.back());
  if (!is_finite(at) || !is_finite(to)) return {};
  switch (mark.kind) {
    case Kind::bar:
      return element("rect", rectangle(at, to) + (mark.text.empty() ? "" : " class=\"" + mark.text + "\""), mark);
    case Kind::error:
      return error_bar(mark, at, to);
    case Kind::dot:
      return element("circle", fmt::format("cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"", at.x, at.y, mark.radius_px),
                     mark);
    case Kind::diamond:
      return element("path",
                     fmt::format("class=\"sized\" d=\"M{0:.1f},{1:.1f}l{2},{2}l-{2},{2}l-{2},-{2}z\"", at.x,
                                 at.y - mark.radius_px, mark.radius_px),
                     mark);
    case Kind::arrow:
      return element(
          "path", fmt::format("transform=\"translate({:.1f},{:.1f})\" d=\"{}\"", at.x, at.y, arrow_path(mark.shift_px)),
          mark);
    case Kind::upright:
      return element("path", fmt::format("d=\"M{:.1f},{}v{}\"", at.x, kTop_px, frame.height_px), mark);
    case Kind::level:
      return element("path", fmt::format("d=\"M{},{:.1f}h{}\"", frame.left_px, at.y, Chart::kFrameWidth_px), mark);
    case Kind::label:
      return fmt::format(
          "<text class=\"sized\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" "
          "style=\"font-weight:600;stroke:#fff;stroke-width:4;stroke-linejoin:round;paint-order:stroke\">{}</text>\n",
          at.x, at.y + 5, html_escaped(mark.text));
    case Kind::picture:
      return fmt::format("<image {} preserveAspectRatio=\"none\" href=\"{}\"/>\n", rectangle(at, to),
                         html_escaped(mark.text));
    default:
      return {};
  }
}

/// Marks of one style as one group.
std::string marks_svg(const std::vector<Mark>& marks, const Frame& frame) {
  using Kind = Mark::Kind;
  const auto group_style = [](const Mark& mark) {
    const bool is_line =
        mark.kind == Kind::curve || mark.kind == Kind::pieces || mark.kind == Kind::error || mark.kind == Kind::arrow;
    return (is_line ? "fill:none;" : "") + mark.style;
  };
  std::string svg, open;
  for (const Mark& mark : marks) {
    const std::string style = group_style(mark);
    if (svg.empty() || style != open) svg += (svg.empty() ? "" : "</g>") + ("<g style=\"" + style + "\">");
    open = style;
    svg += svg_of(mark, frame);
  }
  return svg.empty() ? svg : svg + "</g>\n";
}

/// Where an axis is drawn.
enum class Side { x, y, upper_x };

/// Names side by side that are wider than the frame have a line for each word.
std::string name_below(double x, double y, const std::string& name, bool is_split) {
  constexpr double kLine_px = 16;
  std::string spans;
  for (std::size_t at = 0, line = 0; at <= name.size(); ++line) {
    const std::size_t end = is_split ? std::min(name.find(' ', at), name.size()) : name.size();
    spans += fmt::format("<tspan x=\"{:.1f}\" y=\"{:.1f}\">{}</tspan>", x, y + kLine_px * static_cast<double>(line),
                         html_escaped(name.substr(at, end - at)));
    at = end + 1;
  }
  return "<text text-anchor=\"middle\">" + spans + "</text>\n";
}

/// Ticks and their lines, as a group. A page draws them again where it zooms: the group says of what.
std::string axis_svg(Side side, const Axis& axis, const Frame& frame) {
  constexpr const char* kNames[] = {"x", "y", "x2"};
  std::string svg = fmt::format("<g class=\"axis\" data-side=\"{}\"", kNames[static_cast<int>(side)]);
  if (axis.names.empty())
    svg += fmt::format(" data-ends=\"{} {}\" data-scale=\"{}\"", axis.low, axis.high,
                       axis.scale == Scale::logarithmic ? "log" : "linear");
  svg += ">\n";
  const double n_letters = static_cast<double>(axis.names.size()) * (longest_name(axis) + 2);
  for (const auto& [value, name] : ticks_of(axis)) {
    const double at_x = frame.left_px + Chart::kFrameWidth_px * share(axis, value);
    if (side == Side::y) {
      svg += fmt::format("<path d=\"M{0},{1:.1f}H{2}\" stroke=\"#e3e5e8\"/>", frame.left_px, frame.y(value),
                         frame.right_px()) +
             text(frame.left_px - 6, frame.y(value) + 5, "end", name);
    } else if (side == Side::upper_x) {
      svg += fmt::format("<path d=\"M{0:.1f},{1}v-4\" stroke=\"#444\"/>", at_x, kTop_px) +
             text(at_x, kTop_px - 7, "middle", name);
    } else if (axis.names.empty()) {
      svg += fmt::format("<path d=\"M{0:.1f},{1}V{2}\" stroke=\"#e3e5e8\"/>", at_x, kTop_px, frame.bottom_px()) +
             text(at_x, frame.bottom_px() + 17, "middle", name);
    } else {
      svg += name_below(at_x, frame.bottom_px() + 17, name, n_letters * kLetter_px > Chart::kFrameWidth_px);
    }
  }
  return svg + "</g>\n";
}

/// Squares of colour, each before its text.
std::string key_row(const std::vector<std::pair<std::string, std::string>>& keys, double x) {
  constexpr double kSquare_px = 11, kGap_px = 16;
  const double baseline = kTop_px - 10;
  std::string svg;
  for (const auto& [text, colour] : keys) {
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>\n", x,
                       baseline - kSquare_px + 1, kSquare_px, kSquare_px, colour);
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\">{}</text>\n", x + kSquare_px + 4, baseline, html_escaped(text));
    x += kSquare_px + 4 + kLetter_px * letters_of(text) + kGap_px;
  }
  return svg;
}

}  // namespace

double Chart::ink_height_px() const {
  return are_scales_same_ ? Chart::kFrameWidth_px * std::abs((y_.high - y_.low) / (x_.high - x_.low))
                          : frame_height_px_;
}

double Chart::height_px() const { return kTop_px + ink_height_px() + kBottom_px; }

double Chart::left_px() const { return std::max(kLeast_left_px, 12 + 1.2 * kLetter_px * longest_name(y_)); }

double Chart::width_px() const { return left_px() + kFrameWidth_px + kRight_px; }

std::string Chart::frame_svg() const {
  const Frame frame{x_, y_, left_px(), ink_height_px()};
  const double middle_x = frame.left_px + kFrameWidth_px / 2;
  std::string svg = axis_svg(Side::x, x_, frame) + axis_svg(Side::y, y_, frame);
  if (second_factor_ > 0)
    svg +=
        axis_svg(Side::upper_x, {second_label_, second_factor_ * x_.low, second_factor_ * x_.high, x_.scale}, frame) +
        text(middle_x, kTop_px - 23, "middle", second_label_);
  svg += text(middle_x, frame.bottom_px() + 39, "middle", x_.label);
  // a title longer than its axis is narrowed
  const bool is_long = kLetter_px * letters_of(y_.label) > frame.height_px + 40;
  svg += fmt::format(
      "<text transform=\"translate(15,{}) rotate(-90)\" text-anchor=\"middle\"{}>{}</text>\n",
      kTop_px + frame.height_px / 2,
      is_long ? fmt::format(" textLength=\"{}\" lengthAdjust=\"spacingAndGlyphs\"", frame.height_px) : std::string(),
      html_escaped(y_.label));
  // an inner <svg> cuts off what reaches beyond the frame
  svg += fmt::format(
      "<svg class=\"ink\" x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" viewBox=\"{0} {1} {2} {3}\" "
      "preserveAspectRatio=\"none\">\n{4}</svg>\n"
      "<rect x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" fill=\"none\" stroke=\"#444\"/>\n",
      frame.left_px, kTop_px, kFrameWidth_px, frame.height_px, marks_svg(marks_, frame));
  return svg;
}

std::string Chart::on_page() const {
  const double top_px = second_factor_ > 0 ? kTop_px - 40 : kTop_px - 10;
  return fmt::format("<svg viewBox=\"0 {} {} {}\" font-size=\"13\">\n{}</svg>", top_px, width_px(),
                     height_px() - top_px, frame_svg());
}

std::string Chart::str() const {
  const double left_px = this->left_px();
  std::string svg =
      fmt::format("<text x=\"{}\" y=\"18\" font-weight=\"600\">{}</text>\n", left_px, html_escaped(title_)) +
      fmt::format("<text x=\"{}\" y=\"37\" fill=\"{}\">{}</text>\n", left_px, subtitle_colour_,
                  html_escaped(subtitle_)) +
      frame_svg();
  if (key_side_ == KeySide::above) return svg + key_row(keys_, left_px);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    const bool is_left = key_side_ == KeySide::left;
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"{}\" fill=\"{}\" "
        "style=\"stroke:#fff;stroke-width:4;stroke-linejoin:round;paint-order:stroke\">{}</text>\n",
        left_px + (is_left ? 10 : kFrameWidth_px - 10), kTop_px + 20 + 18 * static_cast<double>(i),
        is_left ? "start" : "end", readable_on_white(keys_[i].second), html_escaped(keys_[i].first));
  }
  return svg;
}

std::string svg_file(const std::vector<Chart>& charts, int n_columns, const std::vector<std::string>& caption) {
  double column_px = 0;
  for (const Chart& chart : charts) column_px = std::max(column_px, chart.width_px());
  const double width = n_columns * column_px;
  std::string body;
  double below = 0, row_height = 0;
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const int column = static_cast<int>(i) % n_columns;
    if (column == 0) {
      below += row_height;
      row_height = 0;
    }
    row_height = std::max(row_height, charts[i].height_px());
    body += fmt::format("<g transform=\"translate({},{})\">\n", column * column_px, below) + charts[i].str() + "</g>\n";
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
