#include "mbtfm/plan/page.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/plan/tables.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/version.h"
#include "pipeline/report/page.h"

namespace mbtfm::plan {

namespace {

std::string colour(std::size_t k) { return charts::kColours[k % std::size(charts::kColours)]; }

std::vector<Expected> rows_of(const Grid& grid, double youngs_modulus_kPa, double noise_um, Quantity quantity) {
  std::vector<Expected> rows;
  for (const Expected& e : grid.expected) {
    if (e.quantity == quantity && e.point.youngs_modulus_kPa == youngs_modulus_kPa && e.point.noise_um == noise_um)
      rows.push_back(e);
  }
  return rows;
}

Quantity drawn_quantity(const Plan& plan) {
  return plan.grid.needed.empty() ? Quantity::total_force : Quantity::fibres;
}

charts::Axis density_axis(const Plan& plan) {
  return charts::axis_over("beads per µm²", plan.asked.beads_per_um2, charts::Scale::logarithmic);
}

charts::Axis error_axis(const Plan& plan) {
  std::vector<double> errors = {plan.asked.target_nN};
  for (const Expected& e : plan.grid.expected)
    if (e.quantity == drawn_quantity(plan)) errors.push_back(e.standard_error_nN);
  return charts::axis_over("standard error of the middle fibre (nN)", errors, charts::Scale::logarithmic);
}

charts::Chart chart_of(const Plan& plan, double noise_um) {
  charts::Chart chart("Noise " + brief(noise_um) + " µm", density_axis(plan), error_axis(plan));
  for (std::size_t k = 0; k < plan.asked.youngs_modulus_kPa.size(); ++k) {
    const double E = plan.asked.youngs_modulus_kPa[k];
    std::vector<Vec2> points;
    for (const Expected& e : rows_of(plan.grid, E, noise_um, drawn_quantity(plan))) {
      points.push_back({e.point.beads_per_um2, e.standard_error_nN});
      chart.dot(points.back(), 3.5, "fill:" + colour(k) + ";stroke:#fff",
                brief(E) + " kPa, " + brief(e.point.beads_per_um2) + " beads per µm²: " + brief(e.standard_error_nN) +
                    " nN, of which " + brief(e.from_beads_nN) + " by the beads; " + brief(100 * e.share_within) +
                    " % of the fibres are within the target");
    }
    chart.curve(points, "fill:none;stroke-width:2;stroke:" + colour(k));
    chart.key(brief(E) + " kPa", colour(k));
  }
  chart.level(plan.asked.target_nN, "stroke:#333;stroke-width:1.5;stroke-dasharray:6 4");
  return chart;
}

report::Table needed_rows(const Plan& plan) {
  report::Table table{.columns = {{"gel (kPa)", true}}, .rows = {}};
  for (const double noise_um : plan.asked.noise_um) table.columns.push_back({"noise " + brief(noise_um) + " µm", true});
  for (const double E : plan.asked.youngs_modulus_kPa) {
    std::vector<std::string> row = {brief(E)};
    for (const Needed& n : plan.grid.needed) {
      if (n.youngs_modulus_kPa != E) continue;
      row.push_back(!n.beads_per_um2                             ? "never"
                    : *n.beads_per_um2 > plan.most_beads_per_um2 ? "&gt; " + brief(plan.most_beads_per_um2)
                                                                 : significant(*n.beads_per_um2, 2));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

report::Table expected_rows(const Plan& plan) {
  report::Table table{.columns = {{"gel (kPa)", true},
                                  {"beads per µm²", true},
                                  {"noise (µm)", true},
                                  {"quantity"},
                                  {"number", true},
                                  {"standard error (nN)", true},
                                  {"by beads", true},
                                  {"by mesh", true},
                                  {"by segmentation", true},
                                  {"by the rest", true},
                                  {"within target (%)", true},
                                  {"two apart from (µm)", true}},
                      .rows = {}};
  for (const Expected& e : plan.grid.expected) {
    table.rows.push_back({brief(e.point.youngs_modulus_kPa), brief(e.point.beads_per_um2), brief(e.point.noise_um),
                          name_of(e.quantity), std::to_string(e.n), brief(e.standard_error_nN), brief(e.from_beads_nN),
                          brief(e.from_mesh_nN), brief(e.from_segmentation_nN), brief(e.from_other_nN),
                          brief(100 * e.share_within), e.least_distance_um ? brief(*e.least_distance_um) : "–"});
  }
  return table;
}

report::Table cell_rows(const Plan& plan) {
  report::Table table{.columns = {{"type"},
                                  {"mean (nN)", true},
                                  {"between cells (nN)", true},
                                  {"within (nN)", true},
                                  {"error (nN)", true},
                                  {"difference (%)", true},
                                  {"fibres per cell", true},
                                  {"cells of each condition", true}},
                      .rows = {}};
  for (const int cells : kCells) table.columns.push_back({"chance with " + std::to_string(cells) + " cells (%)", true});
  for (const CellNumbers& n : plan.cells) {
    std::vector<std::string> row = {
        name_of(n.scatter.type),           brief(n.scatter.mean_nN),
        brief(n.scatter.between_cells_nN), brief(n.scatter.within_nN),
        brief(n.scatter.error_nN),         brief(100 * n.difference),
        brief(n.fibres_per_cell),          n.cells ? std::to_string(*n.cells) : "&gt; 10000"};
    for (const double p : n.power) row.push_back(brief(std::round(100 * p)));
    table.rows.push_back(std::move(row));
  }
  return table;
}

charts::Chart drawn_chart(const Drawn& drawn) {
  std::vector<double> both;
  for (const DrawnTension& t : drawn.tensions) both.insert(both.end(), {t.true_nN, t.found_nN});
  charts::Chart chart("Drawn experiments", charts::axis_over("true tension (nN)", both, charts::Scale::linear),
                      charts::axis_over("found, ± predicted standard error (nN)", both, charts::Scale::linear));
  const double most = *std::ranges::max_element(both);
  chart.curve({{0, 0}, {most, most}}, "fill:none;stroke:#999;stroke-width:1");
  for (const DrawnTension& t : drawn.tensions) {
    const std::string of = colour(static_cast<std::size_t>(t.experiment));
    chart.error({t.true_nN, t.found_nN - t.predicted_error_nN}, {t.true_nN, t.found_nN + t.predicted_error_nN},
                "stroke-width:1;stroke:" + of);
    chart.dot({t.true_nN, t.found_nN}, 3, "fill:" + of + ";stroke:#fff",
              "fibre " + std::to_string(t.fibre_id) + ": true " + brief(t.true_nN) + " nN, found " + brief(t.found_nN) +
                  " ± " + brief(t.predicted_error_nN) + " nN");
  }
  return chart;
}

std::string paragraphs(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<p>" + report::html_escaped(text) + "</p>\n";
  return html;
}

constexpr const char* kHow =
    "<p class=\"sub\">The error by the beads is the Cramér–Rao bound of the fit: it grows in proportion to noise and "
    "modulus and falls with the root of the density. The model's part (meshes, segmentation, what is missing in the "
    "model) is "
    "the same for all of them: it is where the curves level off. “Never” means that this part alone is larger than the "
    "target.</p>\n";

}  // namespace

std::vector<charts::Chart> charts_of(const Plan& plan) {
  std::vector<charts::Chart> charts;
  for (const double noise_um : plan.asked.noise_um) charts.push_back(chart_of(plan, noise_um));
  return charts;
}

std::string svg_of(const Plan& plan) {
  const std::vector<charts::Chart> charts = charts_of(plan);
  return charts::svg_file(charts, std::min<int>(2, static_cast<int>(charts.size())),
                          {plan.name + ": standard error of the middle fibre's tension.",
                           "Dashed: the target of " + brief(plan.asked.target_nN) + " nN."});
}

std::string html_of(const Plan& plan) {
  const std::string head = "<h1>Plan: " + report::html_escaped(plan.name) + "</h1><p class=\"sub\">mbtfm " +
                           std::string(kVersion) + "</p>\n<p><b>" + report::html_escaped(answer_sentence(plan)) +
                           "</b></p>\n" + paragraphs(further_sentences(plan));
  std::string body;
  if (!plan.grid.warnings.empty()) body += report::section("What to mind", paragraphs(plan.grid.warnings));
  std::string curves;
  for (const charts::Chart& chart : charts_of(plan))
    curves += report::figure(chart, "Dashed: the target of " + brief(plan.asked.target_nN) + " nN.");
  body += report::section("Standard error over density", curves + kHow);
  if (!plan.grid.needed.empty())
    body += report::section(
        "Beads per µm² that are needed",
        report::html_of(needed_rows(plan), {"plan_needed.csv", files::text_of(needed_table(), plan.grid.needed)}) +
            "<p class=\"sub\">&gt; " + brief(plan.most_beads_per_um2) +
            ": more beads than can be told apart. “never”: no number of beads suffices.</p>\n");
  if (plan.drawn && !plan.drawn->tensions.empty())
    body += report::section("How well it held",
                            report::figure(drawn_chart(*plan.drawn),
                                           "Tensions found in simulated experiments beside the true ones. The fits "
                                           "know neither the cell's own network nor its tensions."));
  if (!plan.cells.empty())
    body +=
        report::section("How many cells",
                        report::html_of(cell_rows(plan), {"plan_cells.csv", files::text_of(cell_table(), plan.cells)}) +
                            "<p class=\"sub\">Two-sided t test at 5 % of the means of two groups of cells. Scatter: " +
                            report::html_escaped(plan.cells.front().scatter.source) + ".</p>\n");
  body += report::section(
      "All numbers",
      report::html_of(expected_rows(plan), {"plan.csv", files::text_of(expected_table(), plan.grid.expected)}));
  return report::page("Plan – mbtfm", head, body);
}

}  // namespace mbtfm::plan
