/// Small charts of a study as stand-alone SVG: panels side by side, lines with points, or bars.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

namespace mbtfm::test {

struct Series {
  std::string name;
  std::vector<double> x, y;
  bool is_line = true;  ///< else points only
};

struct Panel {
  std::string title, x_label, y_label;
  std::vector<Series> series;
  bool is_log_x = false, is_log_y = false;
};

/// Okabe & Ito: told apart by colour-blind eyes.
inline constexpr const char* kColours[] = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666", "#E69F00"};

inline std::string format(const char* pattern, auto... values) {
  char text[512];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

/// One axis: data to pixels, with round ticks.
struct Axis {
  double low = 0, high = 1, from_px = 0, to_px = 1;
  bool is_log = false;
  double at(double v) const {
    const double a = is_log ? std::log10(std::max(v, low)) : v, l = is_log ? std::log10(low) : low,
                 h = is_log ? std::log10(high) : high;
    return from_px + (to_px - from_px) * (a - l) / (h - l);
  }
  std::vector<double> ticks() const {
    std::vector<double> values;
    if (is_log) {
      const double decades = std::log10(high / low);
      const double step = std::max(1.0, std::ceil(decades / 6));
      for (double e = std::ceil(std::log10(low) - 1e-9); e <= std::log10(high) + 1e-9; e += step)
        values.push_back(std::pow(10, e));
      return values;
    }
    const double raw = (high - low) / 5, power = std::pow(10, std::floor(std::log10(raw)));
    const double step = raw / power > 5   ? 10 * power
                        : raw / power > 2 ? 5 * power
                        : raw / power > 1 ? 2 * power
                                          : power;
    for (double v = std::ceil(low / step) * step; v <= high + 1e-9 * step; v += step)
      values.push_back(std::abs(v) < 1e-9 * step ? 0 : v);
    return values;
  }
};

inline Axis axis_of(const Panel& panel, bool is_x) {
  Axis axis{.is_log = is_x ? panel.is_log_x : panel.is_log_y};
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Series& s : panel.series) {
    for (const double v : is_x ? s.x : s.y) {
      if (axis.is_log && !(v > 0)) continue;
      low = std::min(low, v);
      high = std::max(high, v);
    }
  }
  if (!(high > low)) high = low + 1;
  axis.low = axis.is_log ? low : std::min(low, is_x ? low : 0.0);
  axis.high = axis.is_log ? high : high + 0.04 * (high - axis.low);
  return axis;
}

inline std::string panel_svg(const Panel& panel, double left_px, double width_px, double height_px) {
  Axis x = axis_of(panel, true), y = axis_of(panel, false);
  x.from_px = left_px + 62, x.to_px = left_px + width_px - 20, y.from_px = height_px - 48, y.to_px = 30;
  if (panel.series.size() > 1) y.to_px += 15.0 * static_cast<double>(panel.series.size());  // names above the lines
  std::string svg =
      format("<text x=\"%.0f\" y=\"18\" font-weight=\"bold\">%s</text>\n", left_px + 62, panel.title.c_str());
  for (const double v : y.ticks()) {
    svg += format(
        "<path d=\"M%.1f,%.1fH%.1f\" stroke=\"#e3e5e8\"/><text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%g</text>\n",
        x.from_px, y.at(v), x.to_px, x.from_px - 5, y.at(v) + 4, v);
  }
  for (const double v : x.ticks()) {
    svg += format(
        "<path d=\"M%.1f,%.1fv4\" stroke=\"#444\"/><text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%g</text>\n",
        x.at(v), y.from_px, x.at(v), y.from_px + 17, v);
  }
  svg += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>\n", (x.from_px + x.to_px) / 2,
                y.from_px + 36, panel.x_label.c_str());
  svg += format("<text transform=\"translate(%.1f,%.1f) rotate(-90)\" text-anchor=\"middle\">%s</text>\n", left_px + 13,
                (y.from_px + y.to_px) / 2, panel.y_label.c_str());
  for (std::size_t k = 0; k < panel.series.size(); ++k) {
    const Series& s = panel.series[k];
    const char* colour = kColours[k % std::size(kColours)];
    std::string path;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      path += format("%s%.1f,%.1f", i == 0 ? "M" : "L", x.at(s.x[i]), y.at(s.y[i]));
      if (s.x.size() <= 60)
        svg += format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.6\" fill=\"%s\"/>", x.at(s.x[i]), y.at(s.y[i]), colour);
    }
    if (s.is_line) svg += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"1.8\"/>\n";
    if (panel.series.size() > 1) {
      svg += format("<text x=\"%.1f\" y=\"%.1f\" fill=\"%s\">%s</text>\n", x.from_px,
                    33 + 15.0 * static_cast<double>(k), colour, s.name.c_str());
    }
  }
  return svg;
}

inline std::string open_svg(double width_px, double height_px) {
  return format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\" "
      "font-family=\"DejaVu Sans,sans-serif\" font-size=\"12\">\n<rect width=\"100%%\" height=\"100%%\" "
      "fill=\"#fff\"/>\n",
      width_px, height_px, width_px, height_px);
}

inline std::string chart(const std::vector<Panel>& panels) {
  constexpr double kWidth_px = 400, kHeight_px = 300;
  std::string svg = open_svg(kWidth_px * static_cast<double>(panels.size()), kHeight_px);
  for (std::size_t i = 0; i < panels.size(); ++i)
    svg += panel_svg(panels[i], kWidth_px * static_cast<double>(i), kWidth_px, kHeight_px);
  return svg + "</svg>\n";
}

/// A histogram as a line of bins.
inline Series histogram(const std::string& name, const std::vector<double>& values, double low, double high,
                        int n_bins) {
  Series s{.name = name, .x = {}, .y = {}};
  std::vector<double> counts(static_cast<std::size_t>(n_bins), 0);
  for (const double v : values) {
    const int bin = std::clamp(static_cast<int>((v - low) / (high - low) * n_bins), 0, n_bins - 1);
    counts[static_cast<std::size_t>(bin)] += 1.0 / static_cast<double>(values.size());
  }
  for (int b = 0; b < n_bins; ++b) {
    s.x.push_back(low + (b + 0.5) * (high - low) / n_bins);
    s.y.push_back(counts[static_cast<std::size_t>(b)]);
  }
  return s;
}

}  // namespace mbtfm::test
