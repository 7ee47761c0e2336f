#include "pipeline/report/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace mbtfm::report {
namespace {

// Room around the map for the axes' numbers, in the drawing's px; below it each legend takes one line.
constexpr double kLeft_px = 46, kTop_px = 8, kRight_px = 10, kBottom_px = 48, kArrowLegend_px = 26, kColourBar_px = 40;
constexpr double kInk_px = MapDrawing::kWidth_px - kLeft_px - kRight_px;

/// Plasma (S. van der Walt & N. Smith, matplotlib) without its lightest fifth, which is lost on white paper.
constexpr std::array<std::array<int, 3>, 8> kPlasma = {{{13, 8, 135},
                                                        {70, 3, 159},
                                                        {114, 1, 168},
                                                        {156, 23, 158},
                                                        {189, 55, 134},
                                                        {216, 87, 107},
                                                        {237, 121, 83},
                                                        {251, 159, 58}}};

std::string hover_element(const std::string& hover) {
  return hover.empty() ? "/>" : "><title>" + html_escaped(hover) + "</title>";
}

std::string element(const std::string& tag, const std::string& attributes, const std::string& hover) {
  return "<" + tag + " " + attributes + hover_element(hover) + (hover.empty() ? "" : "</" + tag + ">") + "\n";
}

}  // namespace

Box box_of(const std::vector<Vec2>& points, double margin_um) {
  Box box{points.front(), points.front()};
  for (const Vec2 p : points) {
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y)};
  }
  const Vec2 margin{margin_um, margin_um};
  return {box.low - margin, box.high + margin};
}

std::string ColourScale::colour(double value) const {
  const double share = high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.0;
  const double at = share * (kPlasma.size() - 1);
  const std::size_t i = std::min(kPlasma.size() - 2, static_cast<std::size_t>(at));
  std::string text = "#";
  for (int c = 0; c < 3; ++c) {
    const double mixed = kPlasma[i][c] + (at - static_cast<double>(i)) * (kPlasma[i + 1][c] - kPlasma[i][c]);
    text += fmt::format("{:02x}", static_cast<int>(mixed));
  }
  return text;
}

double round_end(double value) {
  if (!(value > 0)) return 0;
  const std::vector<double> list = ticks(0, value);
  return list.back() >= value ? value : list.back() + list[1];
}

MapDrawing::MapDrawing(const Box& box_um) : box_um_(box_um) {
  px_per_um_ = kInk_px / (box_um.high.x - box_um.low.x);
  height_px_ = px_per_um_ * (box_um.high.y - box_um.low.y);
}

double MapDrawing::x(double x_um) const { return kLeft_px + px_per_um_ * (x_um - box_um_.low.x); }
double MapDrawing::y(double y_um) const { return kTop_px + px_per_um_ * (y_um - box_um_.low.y); }
std::string MapDrawing::point(Vec2 at_um) const { return fmt::format("{:.1f},{:.1f}", x(at_um.x), y(at_um.y)); }

void MapDrawing::polygon(const Polygon& corners_um, const std::string& style, const std::string& hover) {
  std::string points;
  for (const Vec2 p : corners_um) points += point(p) + " ";
  body_ += element("polygon", "points=\"" + points + "\" style=\"" + style + "\"", hover);
}

void MapDrawing::polyline(const Polyline& points_um, const std::string& style, const std::string& hover) {
  std::string points;
  for (const Vec2 p : points_um) points += point(p) + " ";
  body_ += element("polyline", "points=\"" + points + "\" style=\"fill:none;" + style + "\"", hover);
}

void MapDrawing::pieces(const std::vector<std::pair<Vec2, Vec2>>& pieces_um, const std::string& style,
                        const std::string& hover) {
  std::string path;
  for (const auto& [a, b] : pieces_um) path += "M" + point(a) + "L" + point(b);
  body_ += element("path", "d=\"" + path + "\" style=\"fill:none;" + style + "\"", hover);
}

void MapDrawing::dot(Vec2 at_um, double radius_px, const std::string& style, const std::string& hover) {
  body_ += element(
      "circle",
      fmt::format("cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" style=\"{}\"", x(at_um.x), y(at_um.y), radius_px, style),
      hover);
}

namespace {

/// Shaft and two-stroke head; short arrows get a short head.
std::string arrow_path(double x, double y, Vec2 shift_px) {
  const double length = norm(shift_px);
  if (length < 0.5) return {};  // less than a dot
  const Vec2 back = (-std::min(5.0, 0.4 * length) / length) * shift_px;
  const Vec2 side = 0.5 * Vec2{-back.y, back.x};
  return fmt::format("M{:.1f},{:.1f}l{:.1f},{:.1f}m{:.1f},{:.1f}l{:.1f},{:.1f}l{:.1f},{:.1f}", x, y, shift_px.x,
                     shift_px.y, back.x + side.x, back.y + side.y, -back.x - side.x, -back.y - side.y, back.x - side.x,
                     back.y - side.y);
}

}  // namespace

void MapDrawing::arrow(Vec2 from_um, Vec2 shift_px, const std::string& colour) {
  const std::string path = arrow_path(x(from_um.x), y(from_um.y), shift_px);
  if (!path.empty()) body_ += "<path d=\"" + path + "\" style=\"stroke:" + colour + "\"/>\n";
}

void MapDrawing::label(Vec2 at_um, const std::string& text) {
  body_ += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" style=\"font-size:12px;font-weight:600;stroke:#fff;"
      "stroke-width:4;stroke-linejoin:round;paint-order:stroke;pointer-events:none\">{}</text>\n",
      x(at_um.x), y(at_um.y) + 4, html_escaped(text));
}

void MapDrawing::begin_group(const std::string& style) { body_ += "<g style=\"" + style + "\">\n"; }
void MapDrawing::end_group() { body_ += "</g>\n"; }

void MapDrawing::arrow_legend(double length_px, const std::string& text) {
  const double at_y = kTop_px + height_px_ + kBottom_px + legends_px_ + 14;
  legend_ += fmt::format("<path d=\"{}\" style=\"stroke:#111;fill:none;stroke-width:1.6\"/>",
                         arrow_path(kLeft_px, at_y - 5, {length_px, 0}));
  legend_ +=
      fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", kLeft_px + length_px + 8, at_y, html_escaped(text));
  legends_px_ += kArrowLegend_px;
}

void MapDrawing::colour_bar(const ColourScale& scale) {
  const double top = kTop_px + height_px_ + kBottom_px + legends_px_ + 4;
  constexpr int kSteps = 40;
  constexpr double kBar_px = 240;
  for (int i = 0; i < kSteps; ++i) {
    const double value = scale.low + (i + 0.5) / kSteps * (scale.high - scale.low);
    legend_ += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"12\" fill=\"{}\"/>",
                           kLeft_px + kBar_px * i / kSteps, top, kBar_px / kSteps + 0.6, scale.colour(value));
  }
  for (const double tick : ticks(scale.low, scale.high)) {
    const double at = kLeft_px + kBar_px * (tick - scale.low) / (scale.high - scale.low);
    legend_ += fmt::format(
        "<path d=\"M{0:.1f},{1:.1f}v4\" class=\"tick\"/><text x=\"{0:.1f}\" y=\"{2:.1f}\" "
        "text-anchor=\"middle\">{3}</text>",
        at, top + 12, top + 30, readable(tick));
  }
  legend_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", kLeft_px + kBar_px + 12, top + 12,
                         html_escaped(scale.label));
  legends_px_ += kColourBar_px;
}

std::string MapDrawing::str(const std::string& description) const {
  const double total = kTop_px + height_px_ + kBottom_px + legends_px_;
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\">"
      "<rect x=\"{}\" y=\"{}\" width=\"{:.1f}\" height=\"{:.1f}\" class=\"frame\"/>\n",
      kWidth_px, total, html_escaped(description), kLeft_px, kTop_px, kInk_px, height_px_);
  // an inner <svg> cuts off what reaches beyond the frame
  svg +=
      fmt::format("<svg x=\"{0}\" y=\"{1}\" width=\"{2:.1f}\" height=\"{3:.1f}\" viewBox=\"{0} {1} {2:.1f} {3:.1f}\">",
                  kLeft_px, kTop_px, kInk_px, height_px_);
  svg += body_ + "</svg>\n";
  for (const double tick : ticks(box_um_.low.x, box_um_.high.x)) {
    svg += fmt::format(
        "<path d=\"M{0:.1f},{1:.1f}v4\" class=\"tick\"/><text x=\"{0:.1f}\" y=\"{2:.1f}\" "
        "text-anchor=\"middle\">{3}</text>",
        x(tick), kTop_px + height_px_, kTop_px + height_px_ + 18, readable(tick));
  }
  for (const double tick : ticks(box_um_.low.y, box_um_.high.y)) {
    svg += fmt::format(
        "<path d=\"M{0:.1f},{1:.1f}h-4\" class=\"tick\"/><text x=\"{2:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"end\">{4}</text>",
        kLeft_px, y(tick), kLeft_px - 6, y(tick) + 5, readable(tick));
  }
  svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">x (µm)</text>", kLeft_px + kInk_px / 2,
                     kTop_px + height_px_ + 36);
  svg += fmt::format("<text transform=\"translate(13,{:.1f}) rotate(-90)\" text-anchor=\"middle\">y (µm)</text>",
                     kTop_px + height_px_ / 2);
  const double bar_um = round_below(0.25 * (box_um_.high.x - box_um_.low.x));
  const double bar_x = kLeft_px + kInk_px - 12 - bar_um * px_per_um_;
  const double bar_y = kTop_px + height_px_ - 12;
  svg += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"32\" style=\"fill:#fff;fill-opacity:.85\"/>",
      bar_x - 6, bar_y - 25, bar_um * px_per_um_ + 12);
  svg += fmt::format(
      "<path d=\"M{:.1f},{:.1f}h{:.1f}\" style=\"stroke:#111;stroke-width:4\"/><text x=\"{:.1f}\" "
      "y=\"{:.1f}\" text-anchor=\"middle\">{} µm</text>\n",
      bar_x, bar_y, bar_um * px_per_um_, bar_x + bar_um * px_per_um_ / 2, bar_y - 7, readable(bar_um));
  return svg + legend_ + "</svg>\n";
}

}  // namespace mbtfm::report
