#include "pipeline/report/tensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/results.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

using charts::Axis;
using charts::Chart;

/// A fibre with what is known of its tension.
struct FibreRow {
  const Fibre* fibre = nullptr;
  Tension tension;
  std::optional<double> true_tension_nN = {};
  const Fibre* truth = nullptr;
};

/// The fitted fibres, by type, the strongest first.
std::vector<FibreRow> fibre_rows(const CellResults& results) {
  std::vector<FibreRow> rows;
  for (const Fibre& fibre : results.cell.fibres) {
    const auto tension = results.tensions.find(fibre.fibre_id);
    if (tension == results.tensions.end()) continue;
    FibreRow& row = rows.emplace_back(FibreRow{&fibre, tension->second});
    if (!results.comparison) continue;
    for (const ComparedFibre& compared : results.comparison->fibres) {
      if (!compared.found || compared.found->fibre_id != fibre.fibre_id || !compared.truth) continue;
      row.true_tension_nN = compared.true_tension_nN;
      row.truth = &*compared.truth;
    }
  }
  std::ranges::stable_sort(rows, [](const FibreRow& a, const FibreRow& b) {
    return a.fibre->type != b.fibre->type ? a.fibre->type < b.fibre->type : a.tension.tension_nN > b.tension.tension_nN;
  });
  return rows;
}

constexpr double kColumnWidth = 0.6;  // of the marks of one type, as a share of the distance to the next

/// Hollow where it is not identifiable.
std::string mark_style(const FibreRow& row) {
  const std::string colour = colour_of(row.fibre->type);
  return "stroke-width:2;stroke:" + colour + ";fill:" + (row.tension.identifiable ? colour : "#fff");
}

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
  std::string hover = hover_of(*row.fibre, results);
  if (row.true_tension_nN) hover += "\ntruth " + readable(*row.true_tension_nN) + " nN";
  const Tension& t = row.tension;
  if (t.low_nN && t.high_nN)
    chart.error({*t.low_nN, y}, {*t.high_nN, y}, std::string("stroke-width:2;stroke:") + colour_of(row.fibre->type),
                hover);
  chart.dot({t.tension_nN, y}, 4.5, mark_style(row), hover);
  if (row.true_tension_nN)
    chart.diamond({*row.true_tension_nN, y}, 5.5, "fill:#fff;stroke:#000;stroke-width:1.4", hover);
}

std::string type_cell(FibreType type) {
  return "<span class=\"keep\">" + swatch_of(type, colour_of(type)) + full_name_of(type) + "</span>";
}

/// Half of the 95 % interval. Its upper half: the lower one may be cut at zero.
std::optional<double> half_interval_nN(const Tension& t) {
  if (!t.high_nN || !(*t.high_nN > t.tension_nN)) return {};
  return *t.high_nN - t.tension_nN;
}

/// Decimals that suit most fibres: those of the median error. None: as many as each number needs.
std::optional<int> common_decimals(const std::vector<FibreRow>& rows) {
  std::vector<double> errors;
  for (const FibreRow& row : rows)
    if (const auto half = half_interval_nN(row.tension)) errors.push_back(*half);
  if (errors.empty()) return {};
  return decimals_for(numerics::median_in(errors));
}

std::string interval_cell(const Tension& t, std::optional<int> decimals) {
  if (!t.identifiable) return "<b>not identifiable</b>";
  if (!t.low_nN || !t.high_nN) return "–";
  return rounded(*t.low_nN, decimals) + " – " + rounded(*t.high_nN, decimals);
}

/// Truth, error in per cent, error in halves of the interval.
std::vector<std::string> truth_cells(const Tension& t, const std::optional<double>& truth_nN,
                                     std::optional<int> decimals) {
  if (!truth_nN) return {"–", "–", "–"};
  const double error_nN = t.tension_nN - *truth_nN;
  const auto half_nN = half_interval_nN(t);
  // one decimal more than the fit deserves: the truth has no error. A share of less than the interval says nothing.
  return {rounded(*truth_nN, decimals ? std::optional(*decimals + 1) : std::nullopt),
          *truth_nN > half_nN.value_or(0) ? with_sign(100 * error_nN / *truth_nN, 0) : "–",
          half_nN ? with_sign(error_nN / *half_nN, 1) : "–"};
}

std::string true_fibre_cell(const FibreRow& row) {
  if (!row.truth) return "none";
  std::string cell = std::to_string(row.truth->fibre_id);
  if (row.truth->type != row.fibre->type) cell += fmt::format(", <b>{}</b>", full_name_of(row.truth->type));
  return cell;
}

/// The adhesions that hold the fibre.
std::string ends_of(const Fibre& fibre, const char* between) {
  std::string ends;
  for (const auto& id : {fibre.start_adhesion_id, fibre.end_adhesion_id})
    if (id) ends += (ends.empty() ? "" : between) + std::to_string(*id);
  return ends;
}

std::vector<std::string> network_row(const CellResults& results, const Tension& t) {
  const auto half_nN = half_interval_nN(t);
  const std::optional<int> decimals = decimals_for(half_nN);
  std::vector<std::string> row = {"0", "actin network (one cable)", rounded(t.tension_nN, decimals),
                                  interval_cell(t, decimals)};
  if (results.comparison) {
    for (auto& cell : truth_cells(t, results.comparison->true_network_nN, decimals)) row.push_back(cell);
    row.push_back("–");
  }
  row.insert(row.end(), {"–", "all"});
  return row;
}

/// The true fibres that no found one matches, as a sentence.
std::string missed_fibres(const Comparison& comparison) {
  std::string list;
  for (const ComparedFibre& fibre : comparison.fibres) {
    if (fibre.found) continue;
    list += fmt::format("{}{} ({}, {} nN, {} µm)", list.empty() ? "" : ", ", fibre.truth->fibre_id,
                        full_name_of(fibre.truth->type), rounded(fibre.true_tension_nN, {}),
                        readable(length_um(fibre.truth->points_um)));
  }
  return list.empty() ? "" : note("cell.missed-fibres", list);
}

}  // namespace

const char* full_name_of(FibreType type) {
  constexpr std::array kNames = {"dorsal", "transverse arc", "ventral", "edge", "unclassified"};
  return kNames.at(static_cast<std::size_t>(type));
}
const char* bright_colour_of(FibreType type) {
  constexpr std::array kColours = {"#56b4ff", "#ffb728", "#00d68f", "#ff7a52", "#b8b8b8"};
  return kColours.at(static_cast<std::size_t>(type));
}
const char* dashes_of(FibreType type) { return type == FibreType::edge ? ";stroke-dasharray:9 4 2 4" : ""; }

std::string swatch_of(FibreType type, const std::string& colour) {
  // edge fibres are dashed, to be recognised without colours, too
  return fmt::format("<span class=\"type\" style=\"background:{}\"></span>",
                     type == FibreType::edge
                         ? fmt::format("linear-gradient(90deg,{0} 40%,transparent 40% 60%,{0} 60%)", colour)
                         : colour);
}

std::string hover_of(const Fibre& fibre, const CellResults& results) {
  std::string text = fmt::format("fibre {} ({})", fibre.fibre_id, full_name_of(fibre.type));
  if (fibre.type == FibreType::unclassified && !fibre.type_reason.empty()) text += "\n" + fibre.type_reason;
  if (const auto found = results.tensions.find(fibre.fibre_id); found == results.tensions.end()) {
    text += "\nnot fitted";
  } else {
    const Tension& t = found->second;
    text += "\ntension " + readable(t.tension_nN) + " nN";
    if (t.low_nN && t.high_nN)
      text += fmt::format(" (95 % interval {} to {})", readable(*t.low_nN), readable(*t.high_nN));
    if (!t.identifiable) text += "\nnot identifiable: disregard";
  }
  text += fmt::format("\n{} µm long", readable(length_um(fibre.points_um)));
  const std::string ends = ends_of(fibre, " and ");
  return text + (ends.empty() ? ", on no adhesion" : ", on adhesion " + ends);
}

std::string hover_of(const Adhesion& adhesion, const CellResults& results) {
  std::string text =
      fmt::format("{} {}", is_assumed(adhesion.origin) ? name_of(adhesion.origin) : "adhesion", adhesion.adhesion_id);
  if (is_assumed(adhesion.origin)) text += " (assumed, not seen)";
  const auto force = std::ranges::find_if(
      results.forces, [&](const AdhesionForce& f) { return f.adhesion_id == adhesion.adhesion_id; });
  if (force == results.forces.end()) {
    text += "\nnot fitted";
  } else {
    const double force_nN = norm(force->force_nN);
    text += "\nforce " + with_error(force_nN, force->sigma_nN, "nN") + "\ntraction " +
            readable(force_nN / area_stood_for_um2(adhesion)) + " kPa";
  }
  text += (adhesion.origin == AdhesionOrigin::candidate ? "\nlattice cell " : "\narea ") +
          readable(area_stood_for_um2(adhesion)) + " µm²";
  std::string fibres;
  for (const Fibre& fibre : results.cell.fibres)
    if (fibre.start_adhesion_id == adhesion.adhesion_id || fibre.end_adhesion_id == adhesion.adhesion_id)
      fibres += (fibres.empty() ? "" : ", ") + std::to_string(fibre.fibre_id);
  return text + (fibres.empty() ? ", no fibre ends on it" : ", fibre " + fibres);
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
    double sum = 0;
    for (std::size_t k = 0; k < column.size(); ++k) {
      const Tension& t = column[k]->tension;
      sum += t.tension_nN;
      // side by side in the order of size: no mark hides another one
      const double share = column.size() > 1 ? static_cast<double>(k) / static_cast<double>(column.size() - 1) : 0.5;
      const Vec2 at{static_cast<double>(i) + kColumnWidth * (share - 0.5), t.tension_nN};
      const std::string style = mark_style(*column[k]);
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
  if (!std::ranges::all_of(fibre_rows(results), [](const FibreRow& row) { return row.tension.identifiable; }))
    text += " · ○&nbsp;not identifiable";
  return "<div class=\"legend\"><span>" + text + "</span></div>\n";
}

Table tension_table(const CellResults& results) {
  Table table{"Tension of each fibre", {number("fibre"), "type", number("tension (nN)"), number("95 % interval (nN)")}};
  const bool has_truth = results.comparison.has_value();
  if (has_truth)
    for (const char* title : {"truth (nN)", "error (%)", "error / half interval", "true fibre"})
      table.columns.push_back(number(title));
  table.columns.push_back(number("length (µm)"));
  table.columns.push_back("adhesions");
  if (const auto t = results.tensions.find(0); t != results.tensions.end())
    table.rows.push_back(network_row(results, t->second));
  const std::vector<FibreRow> rows = fibre_rows(results);
  const std::optional<int> decimals = common_decimals(rows);
  for (const FibreRow& fibre : rows) {
    std::vector<std::string> row = {std::to_string(fibre.fibre->fibre_id), type_cell(fibre.fibre->type),
                                    rounded(fibre.tension.tension_nN, decimals),
                                    interval_cell(fibre.tension, decimals)};
    if (has_truth) {
      for (auto& cell : truth_cells(fibre.tension, fibre.true_tension_nN, decimals)) row.push_back(cell);
      row.push_back(true_fibre_cell(fibre));
    }
    row.push_back(fmt::format("{:.1f}", length_um(fibre.fibre->points_um)));
    const std::string ends = ends_of(*fibre.fibre, ", ");
    row.push_back(ends.empty() ? "–" : ends);
    table.rows.push_back(row);
  }
  return table;
}

std::string tension_notes(const CellResults& results) {
  const bool has_truth = results.comparison.has_value();
  return note("cell.network-tension", readable(results.fit.network_surface_tension_nN_per_um),
              has_truth ? " " + sentence("cell.truth-errors") : "") +
         (std::ranges::count(results.cell.fibres, FibreType::unclassified, &Fibre::type) > 0 ? note("cell.unclassified")
                                                                                             : "") +
         (has_truth ? missed_fibres(*results.comparison) : "");
}

Coverage coverage_of(const CellResults& results) {
  Coverage coverage;
  for (const FibreRow& row : fibre_rows(results)) {
    const Tension& t = row.tension;
    if (!t.identifiable || !t.low_nN || !t.high_nN || !row.true_tension_nN) continue;
    ++coverage.n;
    if (*row.true_tension_nN >= *t.low_nN && *row.true_tension_nN <= *t.high_nN) ++coverage.n_inside;
  }
  return coverage;
}

}  // namespace mbtfm::report
