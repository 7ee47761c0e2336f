/// Small charts of a study as stand-alone SVG: panels side by side, lines with points.
#pragma once

#include "pipeline/charts/chart.h"
#include "tests/support/test.h"

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
  bool is_x_counted = false;  ///< x is a number of something: whole
};

/// px. A frame grows with the lines of its key beyond two; they stand above the data.
inline double frame_height(std::size_t n_keys) { return 236 + 18 * std::max(0.0, static_cast<double>(n_keys) - 2); }

inline std::string format(const char* pattern, auto... values) {
  char text[512];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

inline std::string open_svg(double width_px, double height_px) {
  return format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\" "
      "font-family=\"DejaVu Sans,sans-serif\" font-size=\"12\">\n<rect width=\"100%%\" height=\"100%%\" "
      "fill=\"#fff\"/>\n",
      width_px, height_px, width_px, height_px);
}

/// An axis over the panel's values; linear ones of y begin at zero, and leave room for the names of the series above.
inline charts::Axis axis_of(const Panel& panel, bool is_x) {
  std::vector<double> values;
  for (const Series& s : panel.series) {
    const std::vector<double>& of_series = is_x ? s.x : s.y;
    values.insert(values.end(), of_series.begin(), of_series.end());
  }
  const bool is_log = is_x ? panel.is_log_x : panel.is_log_y;
  charts::Axis axis = charts::axis_over(is_x ? panel.x_label : panel.y_label, values,
                                        is_log ? charts::Scale::logarithmic : charts::Scale::linear);
  for (double n = std::ceil(axis.low); is_x && panel.is_x_counted && n <= axis.high; ++n)
    axis.names.emplace_back(n, charts::readable(n));
  if (is_x) return axis;
  const std::size_t n = panel.series.size();
  const double key_px = n > 1 ? 18 * static_cast<double>(n) + 10 : 0, room = key_px / (frame_height(n) - key_px);
  if (is_log) {
    axis.high *= std::pow(axis.high / axis.low, room);
  } else {
    const double least = values.empty() ? -1 : *std::min_element(values.begin(), values.end());
    if (least >= 0) axis.low = least > 0 ? 0 : -0.02 * axis.high;  // a point at zero is seen whole
    axis.high += room * (axis.high - axis.low);
  }
  return axis;
}

inline std::string chart(const std::vector<Panel>& panels) {
  std::vector<charts::Chart> all;
  for (const Panel& panel : panels) {
    charts::Chart one(panel.title, axis_of(panel, true), axis_of(panel, false));
    one.put_key(charts::Chart::KeySide::left);
    one.frame_height(frame_height(panel.series.size()));
    for (std::size_t k = 0; k < panel.series.size(); ++k) {
      const Series& s = panel.series[k];
      const std::string colour = charts::kColours[k % std::size(charts::kColours)];
      std::vector<Vec2> points;
      for (std::size_t i = 0; i < s.x.size(); ++i) points.push_back({s.x[i], s.y[i]});
      if (s.is_line) one.curve(points, "stroke:" + colour + ";stroke-width:1.8");
      if (points.size() <= 60)
        for (const Vec2 p : points) one.dot(p, 2.6, "fill:" + colour);
      if (panel.series.size() > 1) one.key(s.name, colour);
    }
    all.push_back(std::move(one));
  }
  return charts::svg_file(all, static_cast<int>(all.size()), {});
}

/// A histogram as a line of bins.
inline Series histogram(const std::string& name, const std::vector<double>& values, double low, double high,
                        int n_bins) {
  Series s{.name = name};
  std::vector<double> counts(static_cast<std::size_t>(n_bins), 0);
  for (const double v : values) {
    const int bin = std::clamp(static_cast<int>((v - low) / (high - low) * n_bins), 0, n_bins - 1);
    counts[bin] += 1.0 / static_cast<double>(values.size());
  }
  for (int b = 0; b < n_bins; ++b) {
    s.x.push_back(low + (b + 0.5) * (high - low) / n_bins);
    s.y.push_back(counts[b]);
  }
  return s;
}

}  // namespace mbtfm::test
