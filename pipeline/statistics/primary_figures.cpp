/// The pictures of a study's primary comparison.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pipeline/statistics/drawing.h"

namespace mbtfm::statistics {

namespace {

using charts::readable;

/// By replicate, in the order of the alphabet; one without a name where none are told.
std::vector<std::string> replicates_of(const Study& study) {
  std::set<std::string> names;
  for (const StudyCell& cell : study.cells) names.insert(cell.replicate);
  return {names.begin(), names.end()};
}

charts::Axis condition_axis(const Sample& sample) {
  charts::Axis axis{.label = {}, .low = -0.5, .high = sample.n_conditions() - 0.5};
  for (int c = 0; c < sample.n_conditions(); ++c) axis.names.emplace_back(c, sample.conditions[c]);
  return axis;
}

/// Of the interval by its own error; zero of one without an error.
double half_of_95(const Observation& o) { return kNormal95 * std::sqrt(o.error_variance); }

/// What lies in one condition's column.
void draw_column(charts::Chart& chart, const Study& study, const Sample& sample, int condition, int kind,
                 const std::vector<std::string>& replicates) {
  constexpr double kWidth = 0.6;
  const auto colour = [&](const StudyCell& cell) {
    return replicates.size() > 1 ? condition_colour(index_of(replicates, cell.replicate)) : condition_colour(condition);
  };
  std::map<int, std::vector<Observation>> by_cell;
  for (const Observation& o : sample.of_group(condition, kind)) by_cell[o.cell].push_back(o);
  const bool is_one_a_cell = sample.is_one_a_cell();
  int n = 0;
  for (const auto& [index, values] : by_cell) {
    const StudyCell& cell = study.cells[index];
    if (is_one_a_cell) break;  // its mean says it all
    for (const Observation& o : values)
      chart.dot({condition + kWidth * place_in_column(++n), o.value}, 2, "fill:" + colour(cell) + ";fill-opacity:.35",
                cell.name + ": " + sample.amount(o.value));
  }
  n = 0;
  for (const auto& [index, values] : by_cell) {
    const StudyCell& cell = study.cells[index];
    const double mean = describe(values_of(values)).mean, x = condition + kWidth * place_in_column(++n);
    if (const double half = half_of_95(values.front()); is_one_a_cell && half > 0)
      chart.error({x, mean - half}, {x, mean + half}, "stroke-width:1;stroke:" + colour(cell));
    chart.dot(
        {x, mean}, 5.5, "stroke:#1a1d21;stroke-width:1;fill:" + colour(cell),
        fmt::format("{}{}{}: {}", cell.name, cell.replicate.empty() ? "" : ", ", cell.replicate, sample.amount(mean)));
  }
}

charts::Chart super_plot(const Study& study, const Measure& m, int kind, const std::string& title) {
  const Sample& sample = m.sample;
  const std::vector<std::string> replicates = replicates_of(study);
  const bool has_bars = sample.is_one_a_cell();
  double least = 0, largest = 0;
  for (const Observation& o : sample.values) {
    if (o.kind != kind) continue;
    const double half = has_bars ? half_of_95(o) : 0;
    if (!sample.is_never_negative) least = std::min(least, o.value - half);
    largest = std::max(largest, o.value + half);
  }
  for (const Summary& s : m.summaries) {
    if (s.kind != sample.kinds[kind] || !s.model) continue;
    least = std::min(least, s.model->low);
    largest = std::max(largest, s.model->high);
  }
  const std::size_t n_keys = replicates.size() > 1 ? replicates.size() : 0;
  charts::Chart chart(
      title, condition_axis(sample),
      charts::Axis{.label = sample.label(), .low = 1.05 * least, .high = end_below_keys(largest, n_keys)});
  for (int c = 0; c < sample.n_conditions(); ++c) draw_column(chart, study, sample, c, kind, replicates);
  for (const Summary& s : m.summaries) {
    if (s.kind != sample.kinds[kind] || !s.model) continue;
    const double x = index_of(sample.conditions, s.condition);
    chart.error({x + 0.4, s.model->low}, {x + 0.4, s.model->high}, "stroke:#1a1d21;stroke-width:2");
    chart.pieces({{{x + 0.34, s.model->estimate}, {x + 0.46, s.model->estimate}}}, "stroke:#1a1d21;stroke-width:2.4",
                 "mean " + sample.amount(s.model->estimate));
  }
  for (std::size_t r = 0; r < n_keys; ++r)
    chart.key(replicates[r].empty() ? "no replicate given" : replicates[r], condition_colour(static_cast<int>(r)));
  return chart;
}

charts::Chart effect_plot(const Primary& primary) {
  std::vector<std::string> names;
  std::vector<double> ends = {0};
  for (const PrimaryDifference& d : primary.differences) {
    names.push_back(d.condition);
    ends.insert(ends.end(), {d.difference.low, d.difference.high});
  }
  charts::Chart chart("Difference from " + primary.reference,
                      charts::axis_over("difference of means (" + primary.unit + ")", ends, charts::Scale::linear),
                      charts::row_axis(names));
  constexpr double kRow_px = 40;
  chart.frame_height(kRow_px * static_cast<double>(std::max<std::size_t>(2, names.size())));
  chart.upright(0, "stroke:#555;stroke-dasharray:4 3");
  for (std::size_t i = 0; i < primary.differences.size(); ++i) {
    const PrimaryDifference& d = primary.differences[i];
    const std::string colour = condition_colour(static_cast<int>(i) + 1), text = sentence_of(primary, d);
    const double y = static_cast<double>(i);
    chart.error({d.difference.low, y}, {d.difference.high, y}, "stroke-width:2;stroke:" + colour, text);
    chart.dot({d.difference.estimate, y}, 5, "fill:" + colour, text);
  }
  return chart;
}

std::vector<charts::Chart> super_plots(const Study& study, const std::vector<Measure>& measures) {
  std::vector<charts::Chart> list;
  for (const Measure& m : measures) {
    for (int kind = 0; kind < m.sample.n_kinds(); ++kind) {
      std::string title = m.sample.name;
      if (m.sample.n_kinds() > 1) title += ": " + m.sample.kinds[kind];
      if (m.sample.each == Observed::adhesions_in_space) title += " of an adhesion";
      list.push_back(super_plot(study, m, kind, title));
    }
  }
  return list;
}

/// What the dots are.
std::string dots_of(const Sample& sample) {
  if (sample.is_one_a_cell()) return std::string("A dot is a ") + sample.cell_name();
  return fmt::format("Small dots: {}; large dots: {}",
                     sample.each == Observed::sheets ? "parts of sheets" : name_of(sample.each), sample.cells_name());
}

}  // namespace

std::optional<Figure> primary_figure(const Study& study, const Analysis& analysis, const StudyParameters& parameters) {
  if (study.conditions.size() < 2) return {};
  const PrimaryChoice choice = primary_choice(study, analysis, parameters);
  if (choice.measure == nullptr) return {};
  const auto is_of_kind = [&](const Observation& o) { return o.kind == choice.kind; };
  if (std::ranges::none_of(choice.measure->sample.values, is_of_kind)) return {};
  const Measure& m = *choice.measure;
  Figure figure{.name = kPrimaryFigure,
                .title = "Primary comparison",
                .caption = dots_of(m.sample) + (replicates_of(study).size() > 1 ? ", coloured by replicate" : "") +
                           ". Line and bar: mean of the mixed model with its 95 % interval." +
                           (analysis.primary.differences.empty()
                                ? ""
                                : " Second chart: difference of means from the reference, with its 95 % interval."),
                .charts = {super_plot(study, m, choice.kind, choice.name)},
                .n_columns = 2};
  if (!analysis.primary.differences.empty()) figure.charts.push_back(effect_plot(analysis.primary));
  return figure;
}

Figure sheet_figure(const Study& study, const Analysis& analysis) {
  Figure figure{
      .name = "sheets",
      .title = "Sheets",
      .caption =
          "A dot with its 95 % interval is a sheet. Where a sheet has several parts of a kind, these are small dots, "
          "and the large one is their mean. Black: mean of the mixed model with its 95 % interval.",
      .charts = super_plots(study, analysis.sheets),
      .n_columns = 3};
  return figure;
}

Figure space_figure(const Study& study, const Analysis& analysis) {
  const bool has_adhesions = std::ranges::any_of(
      analysis.in_space, [](const Measure& m) { return m.sample.each == Observed::adhesions_in_space; });
  return {
      .name = "cells_in_space",
      .title = "Cells in space",
      .caption = std::string("A dot is a cell, with the 95 % interval of its own error if that is known. ") +
                 (has_adhesions ? "Forces of adhesions: small dots, and the large one is the mean of a cell. " : "") +
                 "Black: mean of the mixed model with its 95 % interval.",
      .charts = super_plots(study, analysis.in_space),
      .n_columns = 3};
}

}  // namespace mbtfm::statistics
