#include "pipeline/report/tension_plot.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/report/compare.h"
#include "pipeline/report/hover.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/results.h"

namespace mbtfm::report {
namespace {

using charts::Axis;
using charts::Chart;

constexpr double kColumnWidth = 0.6;  // of the marks of one type, as a share of the distance to the next

/// Largest value to show.
double largest_nN(const std::vector<FibreRow>& rows) {
  double largest = 0;
  for (const FibreRow& row : rows) {
    largest =
        std::max({largest, row.tension.tension_nN, row.tension.high_nN.value_or(0), row.true_tension_nN.value_or(0)});
  }
  return largest > 0 ? 1.03 * largest : 1;
}

void draw_row(Chart& chart, const FibreRow& row, double y, const CellResults& results) {
  const std::string colour = colour_of(row.fibre->type);
  std::string hover = hover_of(*row.fibre, results);
  if (row.true_tension_nN) hover += "\ntruth " + readable(*row.true_tension_nN) + " nN";
  const Tension& t = row.tension;
  if (t.low_nN && t.high_nN) chart.error({*t.low_nN, y}, {*t.high_nN, y}, "stroke-width:2;stroke:" + colour, hover);
  chart.dot({t.tension_nN, y}, 4.5, "stroke-width:2;stroke:" + colour + ";fill:" + (t.identifiable ? colour : "#fff"),
            hover);
  if (row.true_tension_nN)
    chart.diamond({*row.true_tension_nN, y}, 5.5, "fill:#fff;stroke:#000;stroke-width:1.4", hover);
}

struct Look {
  const char *name, *bright_colour;
};
const Look& look_of(FibreType type) {
  static constexpr Look kLooks[] = {
      {"dorsal", "#56b4ff"}, {"transverse arc", "#ffb728"}, {"ventral", "#00d68f"}, {"edge", "#ff7a52"}};
  return kLooks[static_cast<int>(type)];
}

}  // namespace

const char* colour_of(FibreType type) { return charts::colour_of(type); }
const char* full_name_of(FibreType type) { return look_of(type).name; }
const char* bright_colour_of(FibreType type) { return look_of(type).bright_colour; }
const char* dashes_of(FibreType type) { return type == FibreType::edge ? ";stroke-dasharray:9 4 2 4" : ""; }

std::string swatch_of(FibreType type, const std::string& colour) {
  // edge fibres are dashed: eyes that see no colours tell them, too
  return fmt::format("<span class=\"type\" style=\"background:{}\"></span>",
                     type == FibreType::edge
                         ? fmt::format("linear-gradient(90deg,{0} 40%,transparent 40% 60%,{0} 60%)", colour)
                         : colour);
}

std::vector<FibreRow> fibre_rows(const CellResults& results) {
  std::vector<FibreRow> rows;
  for (const Fibre& fibre : results.cell.fibres) {
    const auto tension = results.tensions.find(fibre.fibre_id);
    if (tension == results.tensions.end()) continue;
    FibreRow row;
    row.fibre = &fibre;
    row.tension = tension->second;
    if (results.comparison) {
      for (const ComparedFibre& compared : results.comparison->fibres) {
        if (!compared.found || compared.found->fibre_id != fibre.fibre_id || !compared.truth) continue;
        row.true_tension_nN = compared.true_tension_nN;
        row.true_fibre_id = compared.truth->fibre_id;
        row.true_type = compared.truth->type;
      }
    }
    rows.push_back(row);
  }
  std::ranges::stable_sort(rows, [](const FibreRow& a, const FibreRow& b) {
    return a.fibre->type != b.fibre->type ? a.fibre->type < b.fibre->type : a.tension.tension_nN > b.tension.tension_nN;
  });
  return rows;
}

Chart tension_plot(const CellResults& results) {
  const std::vector<FibreRow> rows = fibre_rows(results);
  std::vector<std::string> names;
  for (const FibreRow& row : rows) names.push_back(fmt::format("{} {}", name_of(row.fibre->type), row.fibre->fibre_id));
  const double largest = largest_nN(rows);
  // from a little below zero: the mark of a tension of zero is seen whole
  Chart chart("Tension of each fibre", {"tension (nN)", -0.02 * largest, largest}, charts::row_axis(names));
  constexpr double kRow_px = 20;
  chart.frame_height(kRow_px * static_cast<double>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) draw_row(chart, rows[i], static_cast<double>(i), results);
  return chart;
}

std::optional<Chart> tensions_by_type(const CellResults& results) {
  const std::vector<FibreRow> rows = fibre_rows(results);
  std::vector<std::vector<const FibreRow*>> columns;  // those of a type follow each other
  for (const FibreRow& row : rows) {
    if (columns.empty() || columns.back().front()->fibre->type != row.fibre->type) columns.emplace_back();
    columns.back().push_back(&row);
  }
  if (std::ranges::none_of(columns, [](const auto& column) { return column.size() > 1; })) return {};
  Axis types{.label = "", .low = -0.6, .high = static_cast<double>(columns.size()) - 0.4};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto& column = columns[i];
    types.names.emplace_back(static_cast<double>(i),
                             fmt::format("{} ({})", name_of(column.front()->fibre->type), column.size()));
  }
  const double largest = largest_nN(rows);
  Chart chart("Tensions by type", types, {"tension (nN)", -0.02 * largest, largest});
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto& column = columns[i];
    const FibreType type = column.front()->fibre->type;
    const std::string colour = colour_of(type);
    double sum = 0;
    for (std::size_t k = 0; k < column.size(); ++k) {
      const Tension& t = column[k]->tension;
      sum += t.tension_nN;
      // side by side in the order of size: no mark hides another one
      const double share = column.size() > 1 ? static_cast<double>(k) / static_cast<double>(column.size() - 1) : 0.5;
      const Vec2 at{static_cast<double>(i) + kColumnWidth * (share - 0.5), t.tension_nN};
      const std::string style = "stroke-width:2;stroke:" + colour + ";fill:" + (t.identifiable ? colour : "#fff");
      const std::string hover = hover_of(*column[k]->fibre, results);
      if (type == FibreType::edge)
        chart.diamond(at, 5, style, hover);
      else
        chart.dot(at, 4.5, style, hover);
    }
    const double mean = sum / static_cast<double>(column.size()), x = static_cast<double>(i);
    chart.pieces({{{x - 0.5 * kColumnWidth, mean}, {x + 0.5 * kColumnWidth, mean}}}, "stroke:#333;stroke-width:1.6",
                 fmt::format("mean of the {} fibres: {} nN", full_name_of(type), readable(mean)));
  }
  return chart;
}

std::string tension_plot_legend(const CellResults& results) {
  std::string text = "●&nbsp;fit with its 95&nbsp;% interval";
  if (results.comparison) text += " · ◇&nbsp;truth";
  for (const FibreRow& row : fibre_rows(results)) {
    if (row.tension.identifiable) continue;
    text += " · ○&nbsp;not identifiable";
    break;
  }
  return "<div class=\"legend\"><span>" + text + "</span></div>\n";
}

}  // namespace mbtfm::report
