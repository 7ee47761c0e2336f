/// The figures of cells and fibres; those of adhesions and directions are in adhesion_figures.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "pipeline/contract/counted.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/texts.h"
#include "pipeline/statistics/drawing.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {
namespace {

using charts::Axis;
using charts::Chart;
using charts::readable;

double largest_of(const Sample& sample) {
  double largest = 0;
  for (const Observation& o : sample.values) largest = std::max(largest, o.value);
  return largest > 0 ? largest : 1;
}

std::string counts(const std::vector<Observation>& own, Observed each) {
  return counted(std::ssize(own), name_of(each)) + ", " + counted(n_cells_of(own), "cells");
}

}  // namespace

std::string colour_of(const Sample& sample, int condition, int kind) {
  if (sample.n_conditions() > 1) return condition_colour(condition);
  return sample.each == Observed::fibres ? charts::colour_of(*named<FibreType>(sample.kinds[kind]))
                                         : condition_colour(kind);
}

std::string counts_by_kind(const Sample& sample) {
  std::string n, cells;
  for (int kind = 0; kind < sample.n_kinds(); ++kind) {
    std::vector<Observation> own;
    std::ranges::copy_if(sample.values, std::back_inserter(own), [&](const Observation& o) { return o.kind == kind; });
    n += (kind == 0 ? "" : ", ") + std::to_string(own.size());
    cells += (kind == 0 ? "" : ", ") + std::to_string(n_cells_of(own));
  }
  return "n = " + n + " " + name_of(sample.each) + " of " + cells + " cells";
}

std::size_t n_keys_of(const Sample& sample) { return sample.n_conditions() > 1 ? sample.conditions.size() : 0; }

void add_condition_keys(Chart& chart, const Sample& sample) {
  for (int c = 0; c < sample.n_conditions() && sample.n_conditions() > 1; ++c) {
    std::vector<Observation> own;
    std::ranges::copy_if(sample.values, std::back_inserter(own),
                         [&](const Observation& o) { return o.group / sample.n_kinds() == c; });
    chart.key(sample.conditions[c] + ": " + counts(own, sample.each), condition_colour(c));
  }
}

namespace {

Figure tensions_by_type(const Study& study, const Analysis& analysis) {
  Chart chart = super_plot(study, analysis.tensions(), std::nullopt, "Tension by fibre type");
  chart.subtitle(counts_by_kind(analysis.tensions().sample), "#555");
  return {.name = "tensions_by_type",
          .title = "Tension of each fibre",
          .caption = report::sentence("study.tensions-by-type"),
          .charts = {chart}};
}

/// Distribution of the tensions of each type, with the share above the thresholds.
Figure tension_distributions(const Analysis& analysis, const StudyParameters& parameters) {
  const Sample& sample = analysis.tensions().sample;
  Figure figure{.name = "tension_distributions",
                .title = "Distribution of the tensions",
                .caption = report::sentence("study.tension-shares", readable(parameters.weak_tension_nN),
                                            readable(parameters.strong_tension_nN)),
                .n_columns = 3};
  for (int kind = 0; kind < sample.n_kinds(); ++kind) {
    std::vector<Histogram> all;
    for (int c = 0; c < sample.n_conditions(); ++c) {
      const std::vector<Observation> own = sample.of_group(c, kind);
      all.push_back({.label = own.empty() ? "" : prefix_of(sample.conditions[c]) + counts(own, sample.each),
                     .colour = colour_of(sample, c, kind),
                     .values = values_of(own)});
    }
    Chart chart = histogram_chart(kind_for_people(sample.kinds[kind]), "tension (nN)", "share of the fibres", all, 0,
                                  largest_of(sample) * 1.0001, charts::Scale::linear);
    chart.upright(parameters.weak_tension_nN, "stroke:#555;stroke-dasharray:4 3");
    chart.upright(parameters.strong_tension_nN, "stroke:#555;stroke-dasharray:4 3");
    figure.charts.push_back(chart);
  }
  return figure;
}

Figure strong_fibres(const Analysis& analysis, const StudyParameters& parameters) {
  const Sample& sample = analysis.tensions().sample;
  Figure figure{.name = "fibres_above",
                .title = "Share of the fibres above a tension",
                .caption = report::sentence("study.shares-above"),
                .n_columns = 2};
  for (const double threshold : thresholds_nN(parameters)) {
    const ColumnPlaces columns{sample};
    Chart chart("Above " + readable(threshold) + " nN", columns.axis(),
                Axis{.label = "share of the fibres (%)", .low = 0, .high = end_below_keys(100, n_keys_of(sample))});
    chart.subtitle(counts_by_kind(sample), "#555");
    for (const ShareAbove& s : analysis.shares) {
      if (s.threshold_nN != threshold) continue;
      const int condition = index_of(sample.conditions, s.condition), kind = index_of(sample.kinds, s.kind);
      const double x = columns.place(condition, kind);
      const std::string colour = colour_of(sample, condition, kind);
      chart.error({x, 100 * s.share.interval.low}, {x, 100 * s.share.interval.high},
                  "stroke:" + colour + ";stroke-width:1.6");
      chart.dot({x, 100 * s.share.value}, 4, "fill:" + colour,
                fmt::format("{}{}: {} % of {}", prefix_of(s.condition), kind_for_people(s.kind),
                            readable(100 * s.share.value), counted(s.n, "fibres")));
      const double y = 100 * s.without_error, r = 0.04;
      chart.curve({{x + 2 * r, y - 1.5}, {x + 4 * r, y + 1.5}}, "stroke:#000;stroke-width:1.6");
      chart.curve({{x + 2 * r, y + 1.5}, {x + 4 * r, y - 1.5}}, "stroke:#000;stroke-width:1.6");
    }
    add_condition_keys(chart, sample);
    figure.charts.push_back(chart);
  }
  return figure;
}

Figure forces_by_cell(const Study& study) {
  std::vector<const StudyCell*> cells;
  double largest = 0;
  for (const StudyCell& cell : study.cells) {
    if (!has_fibres(cell.kind())) continue;
    cells.push_back(&cell);
    largest = std::max(largest, cell.fit.total_force_nN);
  }
  std::ranges::stable_sort(cells, [](const StudyCell* a, const StudyCell* b) {
    return a->condition != b->condition ? a->condition < b->condition : a->fit.total_force_nN > b->fit.total_force_nN;
  });
  const double n = static_cast<double>(cells.size());
  Chart chart("Total force of each cell",
              Axis{.label = counted(std::ssize(cells), "cells"), .low = 0, .high = n, .names = {{n / 2, ""}}},
              Axis{.label = "force (nN)", .low = 0, .high = end_below_keys(largest, study.conditions.size() + 1)});
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const FitSummary& fit = cells[i]->fit;
    const double left = static_cast<double>(i) + 0.1, right = left + 0.8;
    const bool is_known = is_network_known(*cells[i]);
    const double network = is_known ? std::clamp(fit.network_force_nN, 0.0, std::max(0.0, fit.total_force_nN)) : 0;
    const std::string of_network = is_known ? readable(network) + " nN" : "unknown";
    const std::string hover =
        fmt::format("{}: {} nN, of the network {}", cells[i]->name, readable(fit.total_force_nN), of_network);
    chart.bar({left, network}, {right, fit.total_force_nN}, "fill:" + condition_colour(cells[i]->condition), hover);
    chart.bar({left, 0}, {right, network}, "fill:#c9ccd1", hover);
  }
  for (std::size_t c = 0; c < study.conditions.size(); ++c)
    chart.key(prefix_of(study.conditions[c]) + "fibres", condition_colour(static_cast<int>(c)));
  chart.key("network", "#6b7078");
  return {.name = "forces_by_cell",
          .title = "Total force of each cell",
          .caption = report::sentence("study.force-sums"),
          .charts = {chart}};
}

/// "force (nN)" without what is in brackets.
std::string without_unit(const std::string& label) { return label.substr(0, label.find(" (")); }

Figure force_correlations(const Study& study, const Analysis& analysis) {
  Figure figure{.name = "force_correlations",
                .title = "Forces and size of the cell",
                .caption = report::sentence("study.force-and-size"),
                .n_columns = 3};
  std::map<std::pair<std::string, std::string>, std::vector<const Correlation*>> panels;
  std::vector<std::pair<std::string, std::string>> order;
  for (const Correlation& c : analysis.correlations) {
    const std::pair key{c.size, c.force};
    if (!panels.contains(key)) order.push_back(key);
    panels[key].push_back(&c);
  }
  for (const auto& key : order) {
    if (std::ranges::none_of(panels[key], [](const Correlation* c) { return c->line.has_value(); })) continue;
    double x_end = 0, y_end = 0;
    for (const Correlation* c : panels[key]) {
      for (const double x : c->x) x_end = std::max(x_end, x);
      for (const double y : c->y) y_end = std::max(y_end, y);
    }
    const std::string of_force = panels[key].front()->force_label, of_size = panels[key].front()->size_label;
    Chart chart(without_unit(of_force) + " by " + without_unit(of_size),
                Axis{.label = of_size, .low = 0, .high = 1.05 * x_end},
                Axis{.label = of_force, .low = 0, .high = end_below_keys(y_end, panels[key].size())});
    chart.put_key(Chart::KeySide::left);
    for (const Correlation* c : panels[key]) {
      const std::string colour = condition_colour(index_of(study.conditions, c->condition));
      for (std::size_t i = 0; i < c->x.size(); ++i)
        chart.dot({c->x[i], c->y[i]}, 3.2, "fill:" + colour + ";fill-opacity:.7", study.cells[c->cells[i]].name);
      if (!c->line) {
        chart.key(prefix_of(c->condition) + fmt::format("n = {}: too few for a line", c->x.size()), colour);
        continue;
      }
      chart.curve({{0, 0}, {x_end, c->line->slope * x_end}}, "stroke:" + colour + ";stroke-width:1.6");
      std::string text = prefix_of(c->condition) + report::with_error(c->line->slope, c->line->slope_error);
      if (c->line->correlation) text += ", r = " + readable(std::round(100 * *c->line->correlation) / 100);
      chart.key(text + fmt::format(", n = {}", c->x.size()), colour);
    }
    figure.charts.push_back(chart);
  }
  if (figure.charts.empty()) figure.caption = report::sentence("study.few-cells");
  return figure;
}

}  // namespace

std::vector<Figure> figures_of(const Study& study, const Analysis& analysis, const StudyParameters& parameters) {
  std::vector<Figure> figures;
  if (auto primary = primary_figure(study, analysis, parameters)) figures.push_back(std::move(*primary));
  for (const CellKind kind : kKindsOfCells)
    if (!has_fibres(kind) && n_of_kind(study, kind) > 1) figures.push_back(figure_of_kind(study, analysis, kind));
  if (!analysis.has_fibres) return figures;
  if (analysis.tensions().sample.values.empty()) {
    figures.push_back(
        {.name = "tensions_by_type", .title = "Tension of each fibre", .caption = "no fibre has a known tension."});
  } else {
    figures.push_back(tensions_by_type(study, analysis));
    figures.push_back(strong_fibres(analysis, parameters));
    figures.push_back(tension_distributions(analysis, parameters));
  }
  figures.push_back(forces_by_cell(study));
  figures.push_back(force_correlations(study, analysis));
  for (Figure& figure : adhesion_figures_of(analysis)) figures.push_back(std::move(figure));
  return figures;
}

std::string svg_of(const Figure& figure) {
  const int n_columns = std::min<int>(figure.n_columns, static_cast<int>(figure.charts.size()));
  // a line holds about 50 characters for each column of charts
  const std::size_t width = 50 * static_cast<std::size_t>(n_columns);
  std::vector<std::string> lines(1);
  std::istringstream words(figure.caption);
  for (std::string word; words >> word;) {
    if (!lines.back().empty() && lines.back().size() + word.size() > width) lines.emplace_back();
    lines.back() += (lines.back().empty() ? "" : " ") + word;
  }
  return charts::svg_file(figure.charts, n_columns, lines);
}

}  // namespace mbtfm::statistics
