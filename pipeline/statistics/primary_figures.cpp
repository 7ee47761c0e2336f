/// The pictures of a study's primary comparison.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pipeline/report/texts.h"
#include "pipeline/statistics/drawing.h"

namespace mbtfm::statistics {

namespace {

using charts::readable;

/// By replicate, in the order of the alphabet; one without a name if none are given.
std::vector<std::string> replicates_of(const Study& study) {
  std::set<std::string> names;
  for (const StudyCell& cell : study.cells) names.insert(cell.replicate);
  return {names.begin(), names.end()};
}

/// Of the interval by its own error; zero of one without an error.
double half_of_95(const Observation& o) { return kNormal95 * std::sqrt(o.error_variance); }

/// What lies in one column. @param colour  of a cell
template <class Colour>
void draw_column(charts::Chart& chart, const Study& study, const Sample& sample, const std::vector<Observation>& values,
                 double x, double width, const Colour& colour) {
  std::map<int, std::vector<Observation>> by_cell;
  for (const Observation& o : values) by_cell[o.cell].push_back(o);
  const bool is_one_a_cell = sample.is_one_a_cell();
  int n = 0;
  for (const auto& [index, own] : by_cell) {
    if (is_one_a_cell) break;  // its mean says it all
    for (const Observation& o : own)
      chart.dot({x + width * place_in_column(++n), o.value}, 2,
                "fill:" + colour(study.cells[index]) + ";fill-opacity:.35",
                study.cells[index].name + (o.id > 0 ? fmt::format(", {}", o.id) : "") + ": " + sample.amount(o.value));
  }
  n = 0;
  for (const auto& [index, own] : by_cell) {
    const StudyCell& cell = study.cells[index];
    const double mean = describe(values_of(own)).mean, at = x + width * place_in_column(++n);
    if (const double half = half_of_95(own.front()); is_one_a_cell && half > 0)
      chart.error({at, mean - half}, {at, mean + half}, "stroke-width:1;stroke:" + colour(cell));
    chart.dot(
        {at, mean}, 4.5, "stroke:#1a1d21;stroke-width:1;fill:" + colour(cell),
        fmt::format("{}{}{}: {}", cell.name, cell.replicate.empty() ? "" : ", ", cell.replicate, sample.amount(mean)));
  }
}

}  // namespace

charts::Axis ColumnPlaces::axis() const {
  charts::Axis axis{.label = {}, .low = -0.5, .high = (kind ? sample.n_conditions() : sample.n_kinds()) - 0.5};
  for (int c = 0; kind && c < sample.n_conditions(); ++c) axis.names.emplace_back(c, sample.conditions[c]);
  for (int k = 0; !kind && k < sample.n_kinds(); ++k) axis.names.emplace_back(k, kind_for_people(sample.kinds[k]));
  return axis;
}

double ColumnPlaces::width() const { return kind ? 0.8 : 0.8 / sample.n_conditions(); }

double ColumnPlaces::place(int condition, int of_kind) const {
  return kind ? condition : of_kind + width() * (condition + 0.5 - 0.5 * sample.n_conditions());
}

charts::Chart super_plot(const Study& study, const Measure& m, std::optional<int> kind, const std::string& title) {
  const Sample& sample = m.sample;
  const ColumnPlaces columns{sample, kind};
  const std::vector<std::string> replicates = replicates_of(study);
  const bool is_by_replicate = kind && replicates.size() > 1;
  const auto is_shown = [&](int k) { return !kind || *kind == k; };
  double least = 0, largest = 0;
  for (const Observation& o : sample.values) {
    if (!is_shown(o.kind)) continue;
    const double half = sample.is_one_a_cell() ? half_of_95(o) : 0;
    if (!sample.is_never_negative) least = std::min(least, o.value - half);
    largest = std::max(largest, o.value + half);
  }
  for (const Summary& s : m.summaries) {
    if (!is_shown(index_of(sample.kinds, s.kind)) || !s.model) continue;
    least = std::min(least, s.model->low);
    largest = std::max(largest, s.model->high);
  }
  const std::size_t n_keys = is_by_replicate ? replicates.size() : kind ? 0 : n_keys_of(sample);
  charts::Chart chart(
      title, columns.axis(),
      charts::Axis{.label = sample.label(), .low = 1.05 * least, .high = end_below_keys(largest, n_keys)});
  for (int c = 0; c < sample.n_conditions(); ++c) {
    for (int k = 0; k < sample.n_kinds(); ++k) {
      if (!is_shown(k)) continue;
      draw_column(chart, study, sample, sample.of_group(c, k), columns.place(c, k), 0.75 * columns.width(),
                  [&](const StudyCell& cell) {
                    return is_by_replicate ? condition_colour(index_of(replicates, cell.replicate))
                                           : colour_of(sample, c, k);
                  });
    }
  }
  for (const Summary& s : m.summaries) {
    const int k = index_of(sample.kinds, s.kind);
    if (!is_shown(k) || !s.model) continue;
    const double x = columns.place(index_of(sample.conditions, s.condition), k), w = columns.width();
    chart.error({x + 0.5 * w, s.model->low}, {x + 0.5 * w, s.model->high}, "stroke:#1a1d21;stroke-width:2");
    chart.pieces({{{x + 0.42 * w, s.model->estimate}, {x + 0.58 * w, s.model->estimate}}},
                 "stroke:#1a1d21;stroke-width:2.4", "mean " + sample.amount(s.model->estimate));
  }
  if (!kind) add_condition_keys(chart, sample);
  for (std::size_t r = 0; is_by_replicate && r < replicates.size(); ++r)
    chart.key(replicates[r].empty() ? "no replicate given" : replicates[r], condition_colour(static_cast<int>(r)));
  return chart;
}

namespace {

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
  Figure figure{
      .name = kPrimaryFigure,
      .title = "Primary comparison",
      .caption = dots_of(m.sample) + (replicates_of(study).size() > 1 ? ", coloured by replicate" : "") +
                 ". Line and bar: mean of the mixed model with its 95 % interval." +
                 (analysis.primary.differences.empty() ? "" : " " + report::sentence("study.primary-differences")),
      .charts = {super_plot(study, m, choice.kind, choice.name)},
      .n_columns = 2};
  if (!analysis.primary.differences.empty()) figure.charts.push_back(effect_plot(analysis.primary));
  return figure;
}

Figure figure_of_kind(const Study& study, const Analysis& analysis, CellKind kind) {
  const KindInStudy& of = in_study(kind);
  Figure figure{.name = of.figure,
                .title = of.heading,
                .caption = report::sentence("study.figure-of-kind", of.cell, of.parts),
                .n_columns = 3};
  for (const Measure* m : analysis.of_cells(kind))
    figure.charts.push_back(
        super_plot(study, *m, m->sample.n_kinds() > 1 ? std::nullopt : std::optional(0),
                   m->sample.name + (m->sample.each == Observed::adhesions_in_space ? of.of_part : "")));
  return figure;
}

}  // namespace mbtfm::statistics
