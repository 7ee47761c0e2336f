#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/report/texts.h"
#include "pipeline/statistics/drawing.h"

namespace mbtfm::statistics {

using charts::Axis;
using charts::Chart;
using charts::readable;
using charts::Scale;

std::string condition_colour(int condition) {
  // Tol, "muted" (SRON/EPS/TN/09-002, 2021), dark enough for dots on white
  constexpr const char* kColours[] = {"#332288", "#C2556B", "#2F8078", "#882255",
                                      "#7A7A1F", "#AA4499", "#555555", "#4A78B5"};
  return kColours[static_cast<std::size_t>(condition) % std::size(kColours)];
}

double place_in_column(int i) {
  constexpr double kGolden = 0.61803398874989485;
  return std::fmod(i * kGolden, 1.0) - 0.5;
}

double end_below_keys(double largest, std::size_t n_keys) {
  const double used = n_keys == 0 ? 0.05 : 0.07 + 0.077 * static_cast<double>(n_keys);
  return largest > 0 ? largest / (1 - std::min(used, 0.7)) : 1;
}

int index_of(const std::vector<std::string>& list, const std::string& name) {
  const auto at = std::find(list.begin(), list.end(), name);
  MBTFM_ASSERT(at != list.end());
  return static_cast<int>(at - list.begin());
}

namespace {

std::vector<double> edges_between(double low, double high, int n_bins, Scale scale) {
  std::vector<double> edges;
  for (int b = 0; b <= n_bins; ++b) {
    const double share = static_cast<double>(b) / n_bins;
    edges.push_back(scale == Scale::linear ? low + share * (high - low) : low * std::pow(high / low, share));
  }
  return edges;
}

std::vector<double> shares_between(const std::vector<double>& values, const std::vector<double>& edges) {
  std::vector<double> shares(edges.size() - 1, 0);
  for (const double v : values) {
    const auto above = std::upper_bound(edges.begin(), edges.end(), v) - edges.begin();
    const auto bin = std::clamp<std::ptrdiff_t>(above - 1, 0, static_cast<std::ptrdiff_t>(shares.size()) - 1);
    shares[bin] += 1.0 / static_cast<double>(values.size());
  }
  return shares;
}

}  // namespace

int n_bins_of(const std::vector<Histogram>& histograms) {
  std::size_t n = 1;
  for (const Histogram& h : histograms) n = std::max(n, h.values.size());
  return std::max(10, static_cast<int>(std::ceil(std::log2(n))) + 1);
}

Chart histogram_chart(const std::string& title, const std::string& x_label, const std::string& y_label,
                      const std::vector<Histogram>& histograms, double low, double high, Scale scale) {
  std::size_t n_keys = 0;
  for (const Histogram& h : histograms) n_keys += h.label.empty() ? 0 : 1;
  const auto edges = edges_between(low, high, n_bins_of(histograms), scale);
  double largest = 0;
  std::vector<std::vector<double>> shares;
  for (const Histogram& h : histograms) {
    shares.push_back(shares_between(h.values, edges));
    largest = std::max(largest, *std::max_element(shares.back().begin(), shares.back().end()));
  }
  Chart chart(title, Axis{.label = x_label, .low = low, .high = high, .scale = scale},
              Axis{.label = y_label, .low = 0, .high = end_below_keys(largest, n_keys)});
  for (std::size_t h = 0; h < histograms.size(); ++h) {
    if (histograms[h].values.empty()) continue;
    std::vector<Vec2> steps = {{edges.front(), 0}};
    for (std::size_t b = 0; b + 1 < edges.size(); ++b) {
      steps.push_back({edges[b], shares[h][b]});
      steps.push_back({edges[b + 1], shares[h][b]});
    }
    steps.push_back({edges.back(), 0});
    chart.curve(steps, "stroke:" + histograms[h].colour + ";stroke-width:2" +
                           (histograms[h].is_dashed ? ";stroke-dasharray:5 3" : ""));
    if (!histograms[h].label.empty())
      chart.key((histograms[h].is_dashed ? "- - " : "") + histograms[h].label, histograms[h].colour);
  }
  return chart;
}

namespace {

/// Connected adhesions in full lines, the others dashed.
Chart distribution_of(const Sample& sample, const std::string& label) {
  double low = INFINITY, high = 0;
  for (const Observation& o : sample.values) {
    if (o.value > 0) low = std::min(low, o.value);
    high = std::max(high, o.value);
  }
  if (high == 0) low = high = 1;  // all are zero: on the lower end of any axis
  // forces reach down to nothing; three decades below the largest hold all that one would look at
  low = std::max(low, 1e-3 * high);
  std::vector<Histogram> all;
  for (int c = 0; c < sample.n_conditions(); ++c) {
    for (int kind = 0; kind < sample.n_kinds(); ++kind) {
      const std::vector<Observation> own = sample.of_group(c, kind);
      if (own.empty()) continue;
      all.push_back({.label = fmt::format("{}{}: {}, {}", prefix_of(sample.conditions[c]), sample.kinds[kind],
                                          counted(std::ssize(own), "adhesions"), counted(n_cells_of(own), "cells")),
                     .colour = colour_of(sample, c, kind),
                     .values = values_of(own),
                     .is_dashed = kind == 1});
    }
  }
  return histogram_chart(label, label + " (" + sample.unit + ")", "share of the adhesions", all, low, 1.001 * high,
                         Scale::logarithmic);
}

Figure adhesion_distributions(const Analysis& analysis) {
  return {.name = "adhesion_distributions",
          .title = "Area and force of the adhesions",
          .caption = report::sentence("study.areas"),
          .charts = {distribution_of(analysis.of("adhesion_area_um2").sample, "area"),
                     distribution_of(analysis.of("adhesion_force_nN").sample, "force")},
          .n_columns = 2};
}

Figure force_by_area(const Analysis& analysis) {
  const Sample& sample = analysis.of("adhesion_force_nN").sample;
  double x_end = 0, y_end = 0;
  for (const AreaBin& b : analysis.area_bins) {
    x_end = std::max(x_end, b.mean_area_um2);
    y_end = std::max({y_end, b.mean_force_nN, b.interval_nN ? std::min(b.interval_nN->high, 2 * b.mean_force_nN) : 0});
  }
  Chart chart("Mean force of an adhesion by its area", Axis{.label = "area (µm²)", .low = 0, .high = 1.08 * x_end},
              Axis{.label = "mean force (nN)", .low = 0, .high = end_below_keys(y_end, 2 * sample.conditions.size())});
  chart.put_key(Chart::KeySide::left);
  for (std::size_t c = 0; c < sample.conditions.size(); ++c) {
    for (const bool is_connected : {true, false}) {
      const std::string colour =
          condition_colour(sample.n_conditions() == 1 ? (is_connected ? 0 : 1) : static_cast<int>(c));
      std::vector<Vec2> line;
      int n = 0, n_cells = 0;
      for (const AreaBin& b : analysis.area_bins) {
        if (b.condition != sample.conditions[c] || b.is_connected != is_connected) continue;
        n += b.n_adhesions;
        n_cells = std::max(n_cells, b.n_cells);
        line.push_back({b.mean_area_um2, b.mean_force_nN});
        if (b.interval_nN) {
          chart.error({b.mean_area_um2, b.interval_nN->low}, {b.mean_area_um2, b.interval_nN->high},
                      "stroke:" + colour + ";stroke-width:1.6");
        }
        chart.dot(line.back(), 3.6,
                  "fill:" + std::string(is_connected ? colour : "#fff") + ";stroke:" + colour + ";stroke-width:1.6",
                  fmt::format("{} of {}: {} nN", counted(b.n_adhesions, "adhesions"), counted(b.n_cells, "cells"),
                              readable(b.mean_force_nN)));
      }
      if (line.empty()) continue;
      chart.curve(line, "stroke:" + colour + ";stroke-width:1.4" + (is_connected ? "" : ";stroke-dasharray:5 3"));
      chart.key(
          fmt::format("{}{}{}: {}, {}", is_connected ? "" : "- - ", prefix_of(sample.conditions[c]),
                      is_connected ? "connected" : "unconnected", counted(n, "adhesions"), counted(n_cells, "cells")),
          colour);
    }
  }
  return {.name = "adhesion_force_by_area",
          .title = "Force and area of the adhesions",
          .caption = report::sentence("study.force-by-area"),
          .charts = {chart}};
}

Figure directions(const Analysis& analysis) {
  Figure figure{
      .name = "directions", .title = "Directions", .caption = report::sentence("study.angles"), .n_columns = 2};
  const std::vector<std::string>& conditions = analysis.tensions().sample.conditions;
  for (const Relation relation : kRelations) {
    std::vector<Histogram> all;
    for (const DirectionSummary& s : analysis.directions) {
      if (s.relation != relation) continue;
      std::string label = fmt::format("{}{:.0f}°", prefix_of(s.condition), s.mean_angle_deg);
      if (s.angle_interval_deg)
        label += fmt::format(" [{:.0f}, {:.0f}]", s.angle_interval_deg->low, s.angle_interval_deg->high);
      all.push_back({.label = label + fmt::format(", {} of {}", s.n, counted(s.n_cells, "cells")),
                     .colour = condition_colour(index_of(conditions, s.condition)),
                     .values = s.angles_deg});
    }
    if (all.empty()) continue;
    const double end = largest_angle_deg(relation);
    Chart chart = histogram_chart(std::string(full_name_of(relation)), "angle between them (°)", "share", all, 0, end,
                                  Scale::linear);
    chart.level(1.0 / n_bins_of(all), "stroke:#555;stroke-dasharray:4 3");
    figure.charts.push_back(chart);
  }
  if (figure.charts.empty()) figure.caption = "no direction is known.";
  return figure;
}

}  // namespace

std::vector<Figure> adhesion_figures_of(const Analysis& analysis) {
  std::vector<Figure> figures;
  if (analysis.of("adhesion_force_nN").sample.values.empty()) {
    figures.push_back({.name = "adhesion_distributions",
                       .title = "Area and force of the adhesions",
                       .caption = report::sentence("study.no-adhesion")});
  } else {
    figures.push_back(adhesion_distributions(analysis));
    figures.push_back(force_by_area(analysis));
  }
  figures.push_back(directions(analysis));
  return figures;
}

}  // namespace mbtfm::statistics
